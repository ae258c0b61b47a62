"""The level of a force over frequency and amplitude, and the response curves of a given level on it.

References
----------
Karaagacli and Ozguven, Experimental modal analysis of nonlinear systems by using response-controlled stepped-sine
testing, Mech. Syst. Signal Process. 146 (2021), 107023: harmonic force surface, and the curves of constant force on it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from hbsolve.errors import BalanceError
from hbsolve.matlab import Exported
from hbsolve.netcdf import dimensions, read_netcdf
from reduction.array_input import check_finite_number, check_whole_number, freeze_arrays
from reduction.array_type import Array, Real

if TYPE_CHECKING:
    import pandas
    import xarray

#: Unit of the amplitude by derivative.
UNIT = ("m", "m/s", "m/s^2")
#: Intervals between two points of the surface on which a contour is drawn.
CONTOUR_INTERVALS = 24


class LevelContour(NamedTuple):
    """A piece of the response at one level, in the order of its points."""

    angular_frequency: Float[Real, " p"]
    """Omega, shape (p,) [rad/s]."""
    amplitude: Float[Real, " p"]
    """Amplitude in the unit of the surface, shape (p,)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseSurface(Exported):
    """Level of the force that holds each amplitude of a sensor at each frequency; arrays are copied and read-only.

    Parameters
    ----------
    angular_frequency
        Omega, ascending, shape (p,) [rad/s].
    amplitude
        Amplitude of the first harmonic of the sensor, ascending, shape (a,) [m, m/s or m/s^2].
    level
        Scale of the harmonic force, shape (a, p) [-]; NaN where no steady state was found.
    phase
        Phase of the reading under the given force, shape (a, p) [rad].
    other_frequency, other_amplitude
        Whether the state belongs to another sheet of the surface than its neighbour at the frequency before, and at the
        amplitude below, shape (a, p) both.
    derivative
        Whether the sensor reads the displacement (0), the velocity (1) or the acceleration (2).
    """

    angular_frequency: Float[Real, " point"]
    amplitude: Float[Real, " curve"]
    level: Float[Real, "curve point"]
    phase: Float[Real, "curve point"]
    other_frequency: Bool[NDArray[np.bool_], "curve point"]
    other_amplitude: Bool[NDArray[np.bool_], "curve point"]
    derivative: int = 0

    def __post_init__(self) -> None:
        freeze_arrays(self, *dimensions(self), dtype=None)

    @property
    def frequency(self) -> Float[Real, " p"]:
        """Excitation frequencies, shape (p,) [Hz]."""
        return np.asarray(self.angular_frequency / (2 * np.pi))

    def at_level(self, level: float, *, fine: int = CONTOUR_INTERVALS) -> tuple[LevelContour, ...]:
        """All response curves at one level of the force on the surface, also their unstable parts.

        The complex level over the amplitude is smooth where the level itself has a crease, at a resonance. It is
        interpolated by cubic splines over frequency and the logarithm of the amplitude; the contour is straight within
        the cells of the finer grid. Where the cells are wider than a resonance the contour breaks into islands along
        its ridge: compute the surface at more frequencies, or raise `fine`.

        Parameters
        ----------
        level
            Level of the force, positive [-].
        fine
            Number of cells of the finer grid between two points of the surface, in both directions [-].

        Raises
        ------
        BalanceError
            A level that is not positive, no cells, or a surface of a single amplitude.
        """
        from contourpy import LineType, contour_generator

        level = check_finite_number(level, "level", BalanceError)
        if level <= 0:
            raise BalanceError(f"level = {level:g} must be positive: a response at rest has no curve")
        if check_whole_number(fine, "fine", BalanceError) < 1:
            raise BalanceError(f"fine = {fine} must be at least 1: it counts cells between two points")
        if len(self.amplitude) < 2:
            raise BalanceError("the surface has only one amplitude: compute it for at least two")
        stiffness = self.level * np.exp(-1j * self.phase) / self.amplitude[:, None]
        omega, fine_omega = self.angular_frequency, _refine_places(self.angular_frequency, fine)
        decade, fine_decade = np.log(self.amplitude), _refine_places(np.log(self.amplitude), fine)
        along = _interpolate_values(omega, stiffness.T, self.other_frequency.T, fine_omega).T
        # Between two frequencies, amplitudes are connected if they are at both.
        beside = np.searchsorted(omega, fine_omega)
        disconnected = self.other_amplitude[:, beside] | self.other_amplitude[:, np.maximum(beside - 1, 0)]
        between = _interpolate_values(decade, along, disconnected, fine_decade)
        needed = np.abs(between) * np.exp(fine_decade)[:, None]
        lines = contour_generator(fine_omega, fine_decade, np.ma.masked_invalid(needed), line_type=LineType.Separate)
        return tuple(LevelContour(line[:, 0], np.exp(line[:, 1])) for line in map(np.asarray, lines.lines(level)))

    def to_xarray(self) -> "xarray.Dataset":
        """As a labelled data set, frequencies in Hz beside the points."""
        import xarray

        data = xarray.Dataset(
            {name: (dims, getattr(self, name)) for name, dims in dimensions(self).items()},
            coords={"frequency": ("point", self.frequency)},
            attrs={"derivative": self.derivative},
        )
        units = {"angular_frequency": "rad/s", "frequency": "Hz", "phase": "rad", "level": "1"}
        for name, unit in (units | {"amplitude": UNIT[self.derivative]}).items():
            data[name].attrs["units"] = unit
        return data

    def to_pandas(self) -> "pandas.DataFrame":
        """As a table with one row for each amplitude and frequency."""
        import pandas

        curve, point = np.indices(self.level.shape).reshape(2, -1)
        return pandas.DataFrame(
            {
                f"amplitude [{UNIT[self.derivative]}]": self.amplitude[curve],
                "frequency [Hz]": self.frequency[point],
                "level [-]": self.level.ravel(),
                "phase [deg]": np.degrees(self.phase.ravel()),
            }
        )


def load_surface(path: Path | str) -> ResponseSurface:
    """Read a surface that `ResponseSurface.save` wrote.

    Raises
    ------
    BalanceError
        The file is missing or contains no surface.
    """

    def read(data: "xarray.Dataset") -> ResponseSurface:
        values = {name: data[name].values for name in dimensions(ResponseSurface)}
        values |= {name: values[name].astype(bool) for name in ("other_frequency", "other_amplitude")}
        return ResponseSurface(**values, derivative=int(data.attrs["derivative"]))

    return read_netcdf(path, "response surface: give a file that `ResponseSurface.save`", read)


def _refine_places(places: Float[Real, " p"], fine: int) -> Float[Real, " q"]:
    """Places with each interval divided into `fine` parts."""
    number = np.arange(fine * (len(places) - 1) + 1) / fine
    return np.asarray(np.interp(number, np.arange(len(places)), places))


def _interpolate_values(
    x: Float[Real, " p"],
    values: Complex[Array, "p n"],
    disconnected: Bool[NDArray[np.bool_], "p n"],
    fine: Float[Real, " q"],
) -> Complex[Array, "q n"]:
    """Finer values along the first axis; NaN next to a NaN, and where a value is disconnected from its predecessor.

    Each run of connected values has its own spline.
    """
    result = np.full((len(fine), values.shape[1]), np.nan, dtype=np.complex128)
    known = np.isfinite(values)
    connected = known[:-1] & known[1:] & ~disconnected[1:]
    left = np.clip(np.searchsorted(x, fine, side="right") - 1, 0, len(x) - 2)
    for column, tied in enumerate(connected.T):
        ends = np.flatnonzero(np.diff(tied, prepend=False, append=False))
        for first, last in ends.reshape(-1, 2):
            there = (left >= first) & (left < last)
            result[there, column] = CubicSpline(x[first : last + 1], values[first : last + 1, column])(fine[there])
    return result
