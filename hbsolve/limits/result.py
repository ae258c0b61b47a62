"""Limits over frequency and level, with their certificates."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.limits.local_search import LimitSide
from hbsolve.matlab import Exported
from hbsolve.netcdf import dimensions, read_netcdf, write_netcdf
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from reduction.array_input import freeze_arrays
from reduction.array_type import Real, Whole

if TYPE_CHECKING:
    import pandas
    import xarray

SIDES = ("lower", "upper")
#: Variables of data sets and files by field, where these have other names.
VARIABLES = {"initial_slider": "slider", "residual_norm": "residual", "n_undetermined": "stuck"}
#: Arrays that a refinement fills.
REFINED = ("refined", "refined_error", "refined_harmonic", "refined_moved")


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseLimits(Exported):
    """Lower and upper limit of one objective; f frequencies, l levels, s sliders. Arrays are copied and read-only.

    Arrays of both sides have the lower limit first. A limit that was not found is NaN.
    """

    angular_frequency: Float[Real, " point"]
    """Omega, ascending, shape (f,) [rad/s]."""
    level: Float[Real, " level"]
    """Levels of the harmonic force, ascending, shape (l,) [-]."""
    nominal: Float[Real, " slider_number"]
    reach: Float[Real, "level slider_number"]
    """Box |w - nominal| <= reach of each level, shapes (s,) and (l, s), infinite without bounds [m]."""
    value: Float[Real, "side=2 level point"]
    """Limits, shape (2, l, f) [unit of the objective]."""
    motion: Float[Real, "side=2 level point direction coefficient"]
    """Coefficients of the joint directions at the limits, shape (2, l, f, d, nh) [m]."""
    initial_slider: Float[Real, "side=2 level point slider_number"]
    """Slider positions at the first instant, shape (2, l, f, s) [m]."""
    multiplier: Float[Real, "side=2 level point slider_number"]
    """Slider states as multipliers m of eq. 11, shape (2, l, f, s) [-]."""
    share: Float[Real, "side=2 level point state=3"]
    """Fractions of the period in which sliders stick, slip and separate, mean over sliders, shape (2, l, f, 3) [-]."""
    residual_norm: Float[Real, "side=2 level point"]
    """|R| relative to the linear motion, shape (2, l, f) [-]."""
    predicted: Float[Real, "side=2 level point radius=3"]
    realised: Float[Real, "side=2 level point radius=3"]
    """Relative gain of a further step at three radii, predicted by the linear programme and realised, shape
    (2, l, f, 3) [-]."""
    spread: Float[Real, "side=2 level point"]
    starts: Int[Whole, "side=2 level point"]
    """Spread of the final values of local searches from different starts, over the value, and number of these searches,
    shape (2, l, f) [-]."""
    n_undetermined: Int[Whole, "side=2 level point"]
    """Number of sliders whose positions depend on the history, shape (2, l, f) [-]."""
    drift: Float[Real, "side=2 level point"]
    on_bound: Int[Whole, "side=2 level point"]
    """Largest |w - nominal| [m], and number of sliders at the bound [-], shape (2, l, f)."""
    repaired: Bool[NDArray[np.bool_], "side=2 level point"]
    """Whether the limit was found from a sampled state outside earlier limits, shape (2, l, f)."""
    jump: Bool[NDArray[np.bool_], "side=2 level point"]
    """Whether the limit lies on another branch of optima than a neighbour in frequency, shape (2, l, f)."""
    sampled: Float[Real, "side=2 level point"]
    """Lowest and highest value of the sampled states, shape (2, l, f); NaN without an audit."""
    n_sampled: Int[Whole, "level point"]
    """Number of sampled states, shape (l, f) [-]."""
    n_outside: Int[Whole, "side=2 level point"]
    """Number of sampled states outside by more than 0.1 %, before any repair, shape (2, l, f) [-]."""
    refined: Float[Real, "side=2 level point"]
    """Limits with the harmonics and samples for a tolerance (`hbsolve.limits.refined_limits`), shape (2, l, f)
    [unit of the objective]; NaN without a refinement."""
    refined_error: Float[Real, "side=2 level point"]
    """Estimated relative error of the refined limits, shape (2, l, f) [-]."""
    refined_harmonic: Int[Whole, "side=2 level point"]
    """H of the refined limits, shape (2, l, f) [-]."""
    refined_moved: Bool[NDArray[np.bool_], "side=2 level point"]
    """Whether more harmonics moved the limit by more than twice the tolerance: other sliders may then be extreme with
    these harmonics, and a search may find other limits; shape (2, l, f)."""

    def __post_init__(self) -> None:
        freeze_arrays(self, *dimensions(self), dtype=None)

    @property
    def frequency(self) -> Float[Real, " f"]:
        """Excitation frequencies, shape (f,) [Hz]."""
        return np.asarray(self.angular_frequency / (2 * np.pi))

    @property
    def best_value(self) -> Float[Real, "side=2 level point"]:
        """Refined limits if available, else the limits of the search, shape (2, l, f)."""
        return np.where(np.isfinite(self.refined), self.refined, self.value)

    @property
    def lower(self) -> Float[Real, "l f"]:
        """The lower limit, shape (l, f)."""
        return np.asarray(self.value[0])

    @property
    def upper(self) -> Float[Real, "l f"]:
        """The upper limit, shape (l, f)."""
        return np.asarray(self.value[1])

    def state(self, balance: HarmonicBalance, side: LimitSide, level: int, frequency: int) -> SteadyState:
        """The steady state at a limit, by the indices of level and frequency.

        Raises
        ------
        BalanceError
            No such limit, or another balance.
        """
        row = list(LimitSide).index(LimitSide(side))
        if not (0 <= level < len(self.level) and 0 <= frequency < len(self.angular_frequency)):
            raise BalanceError(
                f"there is no limit at level {level} and frequency {frequency}: there are {len(self.level)} levels and "
                f"{len(self.angular_frequency)} frequencies, counted from 0"
            )
        at = row, level, frequency
        if not np.isfinite(self.value[at]):
            raise BalanceError(f"no limit was found at {self.frequency[frequency]:.6g} Hz, level {self.level[level]:g}")
        return steady_state(
            balance.at_level(float(self.level[level])),
            float(self.angular_frequency[frequency]),
            start=self.motion[at],
            slider=self.initial_slider[at],
        )

    def to_xarray(self) -> "xarray.Dataset":
        """As a labelled data set, frequencies in Hz beside the points."""
        import xarray

        data = xarray.Dataset(
            {
                VARIABLES.get(item.name, item.name): (dimensions(self).get(item.name, ()), getattr(self, item.name))
                for item in fields(self)
            },
            coords={"side": list(SIDES), "state": ["stick", "slip", "separated"]},
        )
        return data.assign_coords(frequency=("point", self.frequency, {"units": "Hz"}))

    def to_pandas(self) -> "pandas.DataFrame":
        """As a table with one row for each level and frequency; values are in the unit of the objective."""
        import pandas

        level, point = np.indices(self.value.shape[1:]).reshape(2, -1)
        columns = {"level [-]": self.level[level], "frequency [Hz]": self.frequency[point]}
        for name in ("value", "sampled", "residual_norm", "repaired", "jump", "n_outside", "refined"):
            for side, word in enumerate(SIDES):
                label = word if name == "value" else f"{word} {VARIABLES.get(name, name).replace('_', ' ')}"
                columns[label] = getattr(self, name)[side].ravel()
        return pandas.DataFrame(columns)

    def save(self, path: Path | str) -> None:
        """Write netCDF4 (an HDF5 file).

        Raises
        ------
        BalanceError
            The file cannot be written.
        """
        write_netcdf(self.to_xarray().drop_vars("frequency"), path)


def load_limits(path: Path | str) -> ResponseLimits:
    """Read limits that `ResponseLimits.save` wrote.

    Raises
    ------
    BalanceError
        The file is missing or contains no limits.
    """
    return read_netcdf(path, "limits: give a file that `ResponseLimits.save`", read_limits_from_xarray)


def read_limits_from_xarray(data: "xarray.Dataset") -> ResponseLimits:
    """The limits of a data set that `ResponseLimits.to_xarray` made; a `KeyError` for another data set."""
    # Older files have no refinement.
    blank = make_blank_arrays(**{str(name): size for name, size in data.sizes.items()})
    values = {
        name: unknown if name in REFINED and name not in data else data[VARIABLES.get(name, name)].values
        for name, unknown in blank.items()
    }
    return ResponseLimits(**{name: array.astype(blank[name].dtype) for name, array in values.items()})


def make_blank_arrays(**sizes: int) -> dict[str, NDArray[Any]]:
    """Arrays of `ResponseLimits` for the sizes of their dimensions, filled with NaN, 0 or False."""
    arrays: dict[str, NDArray[Any]] = {}
    for item in fields(ResponseLimits):
        kind: Any = item.type
        if hasattr(kind, "dim_str"):
            blank = next(value for word, value in _BLANK.items() if word in kind.dtypes)
            arrays[item.name] = np.full([sizes[name] for name in dimensions(ResponseLimits)[item.name]], blank)
    return arrays


_BLANK: dict[str, float | np.int64 | bool] = {"float64": np.nan, "int64": np.int64(0), "bool": False}
