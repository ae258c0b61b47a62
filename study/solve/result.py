"""Results of response curves: named outputs, peaks, netCDF and CSV."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.model import DERIVATIVE, Sensor
from hbsolve.continuation.branch import STATES, ResponseBranch
from hbsolve.continuation.refined_branch import MIN_RELATIVE_AMPLITUDE
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.fourier import harmonics, samples_from_coefficients
from hbsolve.stability.branch_stability import BranchStability
from hbsolve.state import SteadyState
from reduction.jointed_system import Joint, JointedSystem
from study.solve.curve import RequestedCurve
from study.solve.model import SolveModel

if TYPE_CHECKING:
    import xarray as xr

#: Unit of each quantity in reports and figures, and its number per SI unit.
DISPLAY_UNIT = {"displacement": ("um", 1e6), "velocity": ("mm/s", 1e3), "acceleration": ("m/s^2", 1.0)}
SI_UNIT = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
#: States of a contact in figures.
DRAWN_STATES = ("stuck", "slipping", "separated")
#: Samples per period and harmonic for the range of an output; the error of the highest harmonic is at most 0.5 %.
SAMPLE_PER_HARMONIC = 32
#: Largest plausible displacement of a vibrating structure [m]; the vibration of the longest bridges is smaller.
MOST_DISPLACEMENT = 10.0


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedCurve:
    """A requested curve and its solution.

    Parameters
    ----------
    curve
        Request of the case.
    branch
        Points of the curve.
    model
        Model of the case.
    stability
        Stability of each point; None if it was not requested.
    """

    curve: RequestedCurve
    branch: ResponseBranch
    model: SolveModel
    stability: BranchStability | None = None

    @property
    def parameter(self) -> Float[NDArray[np.float64], " p"]:
        """Frequency [Hz] or level [-], whichever varies, shape (p,)."""
        return self.branch.frequency if self.curve.parameter == "frequency" else self.level

    @property
    def level(self) -> Float[NDArray[np.float64], " p"]:
        """Levels in the scale of the case, without the factor Omega^level_power, shape (p,) [-]."""
        return np.asarray(self.branch.level / self.branch.angular_frequency**self.model.level_power)

    def level_of(self, state: SteadyState) -> float:
        """Level of one state in the scale of the case, without the factor Omega^level_power [-]."""
        return float(state.level / state.angular_frequency**self.model.level_power)

    def output(self, output: Sensor) -> Complex[NDArray[np.complex128], "p harmonic"]:
        """Coefficients of an output at each point, including the motion of the base that it reads, (p, n_harmonic)."""
        branch, q = self.branch, self.branch.coefficients @ output.row
        omega = np.array([harmonics(float(item), q.shape[1]) for item in branch.angular_frequency])
        base_acceleration = self.model.base_acceleration(output)
        if base_acceleration is not None:
            n = len(base_acceleration)
            q[:, 1:n] += branch.level[:, None] * base_acceleration[1:] / (1j * omega[:, 1:n]) ** 2
        return np.asarray(q * (1j * omega) ** DERIVATIVE[output.quantity] * np.exp(-1j * omega * output.delay))

    def half_range(self, output: Sensor) -> Float[NDArray[np.float64], " p"]:
        """Half the difference of the highest and lowest value in a period, of all harmonics, shape (p,) [SI]."""
        q = self.output(output)
        samples = samples_from_coefficients(q.T, SAMPLE_PER_HARMONIC * q.shape[1])
        return np.asarray(np.ptp(samples, axis=0) / 2)

    @property
    def n_unstable(self) -> Float[NDArray[np.float64], " p"]:
        """Number of unstable multipliers of each point, shape (p,) [-]; NaN if unknown."""
        count = len(self.branch.frequency)
        return np.full(count, np.nan) if self.stability is None else self.stability.n_unstable.astype(np.float64)

    def error(self, name: str) -> Float[NDArray[np.float64], " p"]:
        """Estimate "truncation_error" or "sample_error" of each point, shape (p,) [-]; NaN if unknown."""
        values = np.asarray(getattr(self.branch, name))
        return values if values.size else np.full(len(self.branch.frequency), np.nan)

    def output_error(self, output: Sensor) -> Float[NDArray[np.float64], " p"]:
        """Estimated relative error of an output's amplitude at each point, shape (p,) [-].

        The error is relative to the amplitude of the point, but at least to a thousandth of the largest amplitude; NaN
        if unknown.
        """
        change, harmonic = self.branch.estimated_change, find_main_harmonic(self.model.system)
        if not change.size:
            return np.full(len(self.branch.frequency), np.nan)
        omega = harmonic * self.branch.angular_frequency
        amplitude = np.abs(self.output(output)[:, harmonic]) / omega ** DERIVATIVE[output.quantity]
        amplitude = np.maximum(amplitude, MIN_RELATIVE_AMPLITUDE * amplitude.max())
        changed = np.abs(change @ output.row)
        return np.asarray(np.divide(changed, amplitude, out=np.zeros_like(changed), where=amplitude > 0))

    def peak(self, output: Sensor, harmonic: int) -> int:
        """Index of the largest amplitude of a harmonic of an output, or of the least level of a controlled curve."""
        if self.curve.control is not None:
            return int(np.argmin(self.level))
        return int(np.argmax(np.abs(self.output(output)[:, harmonic])))


def compute_output(
    model: SolveModel, output: Sensor, state: SteadyState
) -> Complex[NDArray[np.complex128], " harmonic"]:
    """Compute the coefficients of an output, including the motion of the base that it reads, shape (n_harmonic,)."""
    q, base_acceleration = state.coefficients @ output.row, model.base_acceleration(output)
    omega = harmonics(state.angular_frequency, len(q))
    if base_acceleration is not None:
        n = len(base_acceleration)
        q[1:n] += state.level * base_acceleration[1:] / (1j * omega[1:n]) ** 2
    return np.asarray(q * (1j * omega) ** DERIVATIVE[output.quantity] * np.exp(-1j * omega * output.delay))


def list_state_names(joint: Joint, names: Sequence[str] = STATES) -> dict[int, str]:
    """Name a joint's states by their index in `STATES`; a stop without friction is closed or separated."""
    return dict(enumerate(names)) if joint.can_slip else {0: "closed", 2: "separated"}


def find_main_harmonic(system: JointedSystem) -> int:
    """Find the lowest harmonic of the load, whose amplitudes and phases are reported [-]."""
    return int(np.flatnonzero(system.dynamic.any(axis=1))[0])


def make_response_dataset(model: SolveModel, curves: Sequence[SolvedCurve], title: str) -> "xr.Dataset":
    """Make a dataset of the points of all curves, with the number of the curve of each point; SI units.

    Complex numbers are stored as real and imaginary parts, since netCDF has no complex numbers.
    """
    import xarray as xr

    branches = [item.branch for item in curves]

    most = max(branch.coefficients.shape[1] for branch in branches)

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([np.asarray(getattr(branch, name)) for branch in branches])

    def padded(values: NDArray[Any]) -> NDArray[Any]:
        return np.pad(values, [(0, 0), (0, most - values.shape[1]), (0, 0)])

    def errors(name: str) -> NDArray[Any]:
        return np.concatenate([item.error(name) for item in curves])

    outputs = np.concatenate(
        [padded(np.stack([item.output(output) for output in model.outputs], axis=2)) for item in curves]
    )
    output_error = [np.stack([item.output_error(output) for output in model.outputs], axis=1) for item in curves]
    coefficients = np.concatenate([padded(branch.coefficients) for branch in branches])
    share = joined("contact_share").reshape(len(coefficients), len(model.system.joints), len(STATES))
    counts = [len(branch.angular_frequency) for branch in branches]
    return xr.Dataset(
        {
            "frequency": ("point", joined("angular_frequency") / (2 * np.pi), {"units": "Hz"}),
            "level": ("point", np.concatenate([item.level for item in curves]), {"units": "1"}),
            "curve": ("point", np.repeat(np.arange(len(curves)), counts), {"long_name": "number of the curve"}),
            "output_real": (("point", "harmonic", "output"), outputs.real, {"units": "SI, see output_unit"}),
            "output_imag": (("point", "harmonic", "output"), outputs.imag, {"units": "SI, see output_unit"}),
            "coefficient_real": (("point", "harmonic", "dof"), coefficients.real, {"units": "m"}),
            "coefficient_imag": (("point", "harmonic", "dof"), coefficients.imag, {"units": "m"}),
            "slider": (("point", "slider"), joined("periodic_slider"), {"units": "m"}),
            "contact_share": (
                ("point", "joint", "state"),
                share,
                {"units": "1", "long_name": "share of the period; a closed stop counts as stick"},
            ),
            "residual_norm": ("point", joined("residual_norm"), {"units": "1"}),
            "output_error": (
                ("point", "output"),
                np.concatenate(output_error),
                {"units": "1", "long_name": "estimated relative error of the amplitude"},
            ),
            "highest_harmonic": ("point", joined("highest_harmonic"), {"long_name": "H of the point"}),
            "n_sample": ("point", joined("n_sample"), {"long_name": "samples per period"}),
            "truncation_error": ("point", errors("truncation_error"), {"units": "1"}),
            "sample_error": ("point", errors("sample_error"), {"units": "1"}),
            "iterations": ("point", joined("iterations")),
            "n_unstable": (
                "point",
                np.concatenate([item.n_unstable for item in curves]),
                {"units": "1", "long_name": "Floquet multipliers outside the unit circle"},
            ),
        },
        coords={
            "harmonic": np.arange(coefficients.shape[1]),
            "output": np.array([output.name for output in model.outputs], dtype=object),
            "output_unit": ("output", np.array([SI_UNIT[output.quantity] for output in model.outputs], dtype=object)),
            "output_motion": (
                "output",
                np.array([model.motion_of(output) or "absolute" for output in model.outputs], dtype=object),
            ),
            "joint": np.array([joint.name for joint in model.system.joints], dtype=object),
            "state": np.array(STATES, dtype=object),
        },
        attrs={
            "title": title,
            "convention": "q(t) = Re sum_k q_k exp(i k Omega t)",
            "curves": "; ".join(f"{number}: {item.curve.label}" for number, item in enumerate(curves)),
            "stop_reasons": "; ".join(f"{number}: {branch.stop_reason.name}" for number, branch in enumerate(branches)),
        },
    )


def format_response_csv(model: SolveModel, curves: Sequence[SolvedCurve]) -> str:
    """Format all curves as CSV, one line per point."""
    harmonic = find_main_harmonic(model.system)
    stream = io.StringIO()
    write = csv.writer(stream, lineterminator="\n").writerow
    head = ["curve", "frequency [Hz]", "level"]
    for output in model.outputs:
        unit, name = DISPLAY_UNIT[output.quantity][0], f"{output.name} {model.motion_of(output)}".rstrip()
        head += [f"{name} amplitude [{unit}]", f"{name} phase [deg]", f"{name} half range [{unit}]", f"{name} error"]
    head += [f"{joint.name} {state}" for joint in model.system.joints for state in list_state_names(joint).values()]
    with_stability = any(item.stability for item in curves)
    head += ["unstable multipliers"] if with_stability else []
    write([*head, "highest harmonic", "truncation error", "sample error", "residual norm", "iterations"])
    for item in curves:
        branch = item.branch
        columns = [branch.frequency, item.level]
        for output in model.outputs:
            scale = DISPLAY_UNIT[output.quantity][1]
            q = item.output(output)[:, harmonic]
            columns += [scale * np.abs(q), np.degrees(np.angle(q)), scale * item.half_range(output)]
            columns += [item.output_error(output)]
        for number, joint in enumerate(model.system.joints):
            columns += [branch.contact_share[:, number, state] for state in list_state_names(joint)]
        columns += [item.n_unstable] if with_stability else []
        columns += [
            branch.highest_harmonic,
            item.error("truncation_error"),
            item.error("sample_error"),
            branch.residual_norm,
        ]
        for point, values in enumerate(zip(*columns, strict=True)):
            cells = (f"{value:.10g}" for value in values)
            write([item.curve.label, *cells, int(branch.iterations[point])])
    return stream.getvalue()


@dataclass(frozen=True, kw_only=True)
class CurveSummary:
    """Summary of one curve; its fields are the entry in the JSON document.

    Parameters
    ----------
    label
        Label of the curve.
    peak_frequency_hz, peak_level
        Frequency and level of the highest point [Hz, -].
    peak_amplitude, unit
        Amplitude of the first output at the highest point, and its unit.
    peak_at_end
        Whether the highest point is at an end of the sweep, so that the response may be larger outside.
    n_point
        Number of points of the curve [-].
    peak_truncation_error
        Truncation error at the highest point [-]; NaN if unknown.
    truncation_error
        Largest truncation error of all points [-].
    stop_reason
        Reason for the end of the curve, in words.
    bifurcations
        Kind, frequency [Hz] and level of each bifurcation; None if stability was not requested.
    """

    label: str
    peak_frequency_hz: float
    peak_level: float
    peak_amplitude: float
    unit: str
    peak_at_end: bool
    n_point: int
    peak_truncation_error: float
    truncation_error: float
    stop_reason: str
    bifurcations: Sequence[Mapping[str, Any]] | None = None


def find_highest_point(item: SolvedCurve, output: Sensor, harmonic: int) -> CurveSummary:
    """Find the highest point of a curve, and summarise the curve."""
    unit, scale = DISPLAY_UNIT[output.quantity]
    point, branch = item.peak(output, harmonic), item.branch
    return CurveSummary(
        label=item.curve.label,
        peak_frequency_hz=float(branch.frequency[point]),
        peak_level=float(item.level[point]),
        peak_amplitude=scale * float(np.abs(item.output(output)[point, harmonic])),
        unit=unit,
        peak_at_end=_is_at_end(branch, point),
        n_point=len(branch.frequency),
        peak_truncation_error=float(item.error("truncation_error")[point]),
        truncation_error=float(item.error("truncation_error").max()),
        stop_reason=branch.stop_message,
        bifurcations=None
        if item.stability is None
        else [
            {"kind": point.kind.label, "frequency_hz": point.state.frequency, "level": item.level_of(point.state)}
            for point in item.stability.bifurcations
        ],
    )


def _is_at_end(branch: ResponseBranch, point: int) -> bool:
    """Whether a point is at an end of the sweep; isolas have no ends, and other curves may end inside the sweep."""
    if branch.stop_reason is StopReason.ISOLA:
        return False
    return point == 0 or (point == len(branch.frequency) - 1 and branch.stop_reason is StopReason.REACHED)


def describe_motion_warning(curves: Sequence[SolvedCurve], outputs: Sequence[Sensor]) -> str:
    """Describe the largest displacement in one sentence, if it is implausible for a vibrating structure; else empty."""
    largest, where = 0.0, ""
    for item in curves:
        for output in outputs:
            omega = np.maximum(item.branch.angular_frequency, np.finfo(float).tiny) ** DERIVATIVE[output.quantity]
            moved = float((item.half_range(output) / omega).max())
            if moved > largest:
                largest, where = moved, f'{output.name} moves by {moved:.3g} m on the curve "{item.curve.label}"'
    if largest <= MOST_DISPLACEMENT:
        return ""
    return f"{where}: more than {MOST_DISPLACEMENT:g} m is not plausible; check levels, loads and units"
