"""A curve of periodic responses."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from hbsolve.balance import choose_samples
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import BalanceError
from hbsolve.matlab import Exported
from hbsolve.netcdf import dimensions, read_netcdf
from hbsolve.sampling import real_from_complex
from hbsolve.state import SteadyState, harmonic_at
from reduction.array_input import check_whole_number, freeze_arrays
from reduction.array_type import Array, Real

if TYPE_CHECKING:
    import pandas
    import xarray

    from hbsolve.balance import HarmonicBalance

Numbers = Float[Real, " point"]
#: States of a contact, in the order of `contact_share`.
STATES = ("stick", "slip", "separated")
#: Fields with complex numbers.
COMPLEX = ("coefficients", "estimated_change")
#: Variables of data sets and files by field, where these have other names.
VARIABLES = {"periodic_slider": "slider"}


def _none() -> Real:
    return np.zeros(0)


def _no_change() -> NDArray[np.complex128]:
    return np.zeros((0, 0), dtype=np.complex128)


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseBranch(Exported):
    """Periodic responses along a curve; arrays are copied and read-only.

    Parameters
    ----------
    angular_frequency
        Omega of each point, shape (p,) [rad/s].
    coefficients
        Coefficients in the convention of `hbsolve.fourier`, shape (p, n_harmonic, r) [m].
    residual_norm
        Residual of the balance, relative to the linear motion or, without joints, to the force, shape (p,) [-].
    stop_reason
        Reason why the curve ends.
    stopped_at
        Lambda where it ends, with the unit; empty where it ends as requested.
    leaps
        Indices of points after a jump of the curve: it could not be followed from the point before, which differs by
        more than a step, so that the point may be on another branch.
    level
        Scale of the harmonic force at each point; ones by default, shape (p,) [-].
    iterations
        Newton iterations of each point, shape (p,) [-].
    periodic_slider
        Slider positions at the start of the steady period, shape (p, s) [m].
    contact_share
        Fractions of the period in which each joint sticks, slips and is separated, shape (p, n_joint, 3) [-].
    joint_names
        Names of the joints, in order.
    truncation_error, sample_error
        Estimated relative error of the main harmonic of the joint directions due to truncated harmonics, and due to the
        number of samples (`hbsolve.truncation`), shape (p,) [-]; empty if not computed.
    estimated_change
        Estimated change of the main harmonic of all degrees of freedom with more harmonics and samples, shape (p, r)
        [m]; empty if not computed.
    highest_harmonic, n_sample
        H, and samples per period, of each point, shape (p,) [-]; coefficients beyond H are zero. By default the
        highest harmonic of the coefficients, and the default number of samples for it.
    """

    angular_frequency: Numbers
    coefficients: Complex[Array, "point harmonic degree_of_freedom"]
    residual_norm: Numbers
    stop_reason: StopReason
    stopped_at: str = ""
    leaps: tuple[int, ...] = ()
    level: Numbers = field(default_factory=_none)
    iterations: Numbers = field(default_factory=_none)
    periodic_slider: Float[Real, "point slider"] = field(default_factory=_none)
    contact_share: Float[Real, "point joint state=3"] = field(default_factory=_none)
    joint_names: tuple[str, ...] = ()
    truncation_error: Numbers = field(default_factory=_none)
    sample_error: Numbers = field(default_factory=_none)
    estimated_change: Complex[Array, "point degree_of_freedom"] = field(default_factory=_no_change)
    highest_harmonic: Numbers = field(default_factory=_none)
    n_sample: Numbers = field(default_factory=_none)

    def __post_init__(self) -> None:
        count, n_harmonic = len(self.angular_frequency), np.shape(self.coefficients)[1]
        for name, value in (
            ("level", 1), ("iterations", 0), ("highest_harmonic", n_harmonic - 1),
            ("n_sample", choose_samples(n_harmonic)),
        ):  # fmt: skip
            if not np.size(getattr(self, name)):
                object.__setattr__(self, name, np.full(count, float(value)))
        for name, shape in (("periodic_slider", (count, 0)), ("contact_share", (count, 0, 3))):
            if not np.size(getattr(self, name)):
                object.__setattr__(self, name, np.zeros(shape))
        freeze_arrays(self, *COMPLEX, dtype=np.complex128)
        freeze_arrays(self, *(name for name in dimensions(self) if name not in COMPLEX))
        object.__setattr__(self, "joint_names", tuple(self.joint_names))

    @property
    def frequency(self) -> Numbers:
        """Excitation frequencies, shape (p,) [Hz]."""
        return np.asarray(self.angular_frequency / (2 * np.pi))

    @property
    def stop_message(self) -> str:
        """Why the curve ends, in a sentence, and where it jumps."""
        ends = self.stop_reason.sentence(self.stopped_at)
        if not self.leaps:
            return ends
        places = (f"{self.frequency[at]:.6g} Hz, level {self.level[at]:.6g}" for at in self.leaps)
        return (
            f"{ends}; it could not be followed to {' and '.join(places)}, and jumps there, possibly to another branch"
        )

    def output(self, row: int | Float[Real, " r"], harmonic: int = 1, derivative: int = 0) -> Complex[Array, " p"]:
        """Complex amplitude of one harmonic at an output, shape (p,) [m, m/s or m/s^2].

        Parameters
        ----------
        row
            A degree of freedom, or the output's row over all of them.
        harmonic
            Harmonic k.
        derivative
            0 for the displacement, 1 for the velocity, 2 for the acceleration.

        Raises
        ------
        BalanceError
            A harmonic or a degree of freedom that the branch does not have, a row of another size, or a derivative
            that is not one of these.
        """
        at = harmonic_at(self.coefficients, row, harmonic)
        if check_whole_number(derivative, "derivative", BalanceError) not in (0, 1, 2):
            raise BalanceError(f"derivative = {derivative} must be 0, 1 or 2: displacement, velocity or acceleration")
        return np.asarray((1j * harmonic * self.angular_frequency) ** derivative * at)

    def amplitude(self, row: int | Float[Real, " r"], harmonic: int = 1, derivative: int = 0) -> Numbers:
        """Amplitude of `output`, shape (p,) [m, m/s or m/s^2]."""
        return np.asarray(np.abs(self.output(row, harmonic, derivative)))

    def start(self, balance: "HarmonicBalance", index: int) -> Float[Real, "d nh"]:
        """Motion of the joints at a point, for `steady_state` or a continuation to start from, shape (d, 2 H + 1) [m].

        Parameters
        ----------
        balance
            Balance that starts there; coefficients of harmonics that the branch does not have are zero.
        index
            Index of the point; negative from the end.

        Raises
        ------
        BalanceError
            No such point, or a balance of another structure.
        """
        count, n_harmonic, n_dof = self.coefficients.shape
        number = check_whole_number(index, "index", BalanceError)
        if not -count <= number < count:
            raise BalanceError(f"there is no point {number}: the branch has {count}, give 0 to {count - 1}")
        if n_dof != balance.system.n_dof:
            raise BalanceError(
                f"the branch has {n_dof} degrees of freedom, the balance {balance.system.n_dof}: give the balance of "
                "the same structure"
            )
        retained = min(n_harmonic, balance.n_harmonic)
        motion = np.zeros((balance.n_harmonic, balance.n_direction), dtype=np.complex128)
        motion[:retained] = self.coefficients[number, :retained] @ balance.structure.directions.T
        return real_from_complex(motion)

    def balance_at(self, balance: "HarmonicBalance", index: int) -> "HarmonicBalance":
        """The balance of a point: that of the branch, at the level and with the harmonics and samples of the point."""
        of_point = int(self.highest_harmonic[index]) + 1, int(self.n_sample[index])
        at_level = balance.at_level(float(self.level[index]))
        if of_point == (balance.n_harmonic, balance.n_sample):
            return at_level
        return at_level.with_harmonics(*of_point)

    def state(self, balance: "HarmonicBalance", index: int) -> SteadyState:
        """One point as a steady state of `balance_at`, whose sliders are those of the steady period.

        Parameters
        ----------
        balance
            Balance with which the branch was found.
        index
            Index of the point.
        """
        q = self.coefficients[index, : int(self.highest_harmonic[index]) + 1]
        return SteadyState(
            angular_frequency=float(self.angular_frequency[index]),
            level=float(self.level[index]),
            displacement=q @ balance.structure.directions.T,
            coefficients=q,
            initial_slider=self.periodic_slider[index],
            multiplier=False,
            periodic_slider=self.periodic_slider[index],
            residual_norm=float(self.residual_norm[index]),
            iterations=int(self.iterations[index]),
        )

    def to_xarray(self) -> "xarray.Dataset":
        """As a labelled data set, with units as attributes."""
        import xarray

        data = xarray.Dataset(
            {
                VARIABLES.get(name, name): (dims, getattr(self, name))
                for name, dims in dimensions(self).items()
                if getattr(self, name).size
            },
            coords={
                "frequency": ("point", self.frequency),
                "harmonic": np.arange(self.coefficients.shape[1]),
                "state": list(STATES),
                "joint": list(self.joint_names),
            },
            attrs={
                "stop_reason": self.stop_reason.name,
                "stopped_at": self.stopped_at,
                "leaps": " ".join(map(str, self.leaps)),
                "convention": "q(t) = Re sum_k q_k exp(i k Omega t)",
            },
        )
        for name, unit in _UNITS.items():
            if name in data.variables:
                data[name].attrs["units"] = unit
        return data

    def to_pandas(
        self, outputs: "Mapping[str, int | Float[Real, ' r']] | None" = None, harmonic: int = 1
    ) -> "pandas.DataFrame":
        """As a table with one row for each point.

        Parameters
        ----------
        outputs
            Degree of freedom, or row over all of them, of each output, by the name of its columns; none by default.
        harmonic
            Harmonic of which amplitude and phase are given.

        Raises
        ------
        BalanceError
            As `output`.
        """
        import pandas

        columns: dict[str, Real] = {"frequency [Hz]": self.frequency, "level [-]": self.level}
        which = "" if harmonic == 1 else f" of harmonic {harmonic}"
        for name, row in (outputs or {}).items():
            values, of = self.output(row, harmonic), f"{name}{which}"
            columns |= {f"{of} amplitude [m]": np.abs(values), f"{of} phase [deg]": np.degrees(np.angle(values))}
        for number, joint in enumerate(self.joint_names):
            for state, name in enumerate(STATES):
                columns[f"{joint} {name} [-]"] = self.contact_share[:, number, state]
        for column in ("highest_harmonic", "truncation_error", "sample_error", "residual_norm", "iterations"):
            if getattr(self, column).size:
                columns[f"{column.replace('_', ' ')} [-]"] = getattr(self, column)
        return pandas.DataFrame(columns)


def load_branch(path: Path | str) -> ResponseBranch:
    """Read a branch that `ResponseBranch.save` wrote.

    Raises
    ------
    BalanceError
        The file is missing or contains no branch.
    """

    def read(data: "xarray.Dataset") -> ResponseBranch:
        names = {name: VARIABLES.get(name, name) for name in dimensions(ResponseBranch)}
        values = {name: data[variable].values for name, variable in names.items() if variable in data.variables}
        for name in COMPLEX:
            if f"{name}_real" in data.variables:
                values[name] = data[f"{name}_real"].values + 1j * data[f"{name}_imag"].values
        return ResponseBranch(
            **values,
            stop_reason=StopReason.read(str(data.attrs["stop_reason"])),
            stopped_at=str(data.attrs.get("stopped_at", "")),
            leaps=tuple(int(item) for item in str(data.attrs.get("leaps", "")).split()),
            joint_names=tuple(str(name) for name in data["joint"].values),
        )

    return read_netcdf(path, "response branch: give a file that `ResponseBranch.save`", read)


_UNITS = {"angular_frequency": "rad/s", "frequency": "Hz", "coefficients": "m", "slider": "m", "estimated_change": "m"}
