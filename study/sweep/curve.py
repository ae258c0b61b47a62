"""A response curve of a point of a grid, as a stage; the stored result is small, since there may be thousands."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from geometry.errors import ComputationFailed
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.peak import interpolated_peak
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.energy import energy_balance
from hbsolve.errors import NoPeakError
from pipeline.store import stage
from study.solve.curve import RequestedCurve, response_curve
from study.solve.model import SolveModel
from study.solve.refinement import refine_curve
from study.solve.result import SolvedCurve, find_main_harmonic

Real = NDArray[np.float64]
Values = Float[Real, " p"]


@dataclass(frozen=True, kw_only=True, eq=False)
class PointCurve:
    """A response curve of a point.

    Parameters
    ----------
    curve
        Request of the case.
    frequency, level
        Frequency and level along the curve, shape (p,) [Hz, -]; empty if there is no curve.
    response
        Main harmonic of each output, shape (n_output, p) [SI].
    truncation_error
        Truncation error of each point, shape (p,) [-].
    damping
        Equivalent damping ratio at the highest point of each output, half of the loss factor, shape (n_output,) [-].
    stop_message
        Reason for the end of the curve, or for a missing curve.
    complete
        Whether the curve reaches the end of its range.
    """

    curve: RequestedCurve
    frequency: Values
    level: Values
    response: Complex[NDArray[np.complex128], "output p"]
    truncation_error: Values
    damping: Float[Real, " output"]
    stop_message: str
    complete: bool

    @property
    def parameter(self) -> Values:
        """Frequency [Hz] or level [-], whichever varies, shape (p,)."""
        return self.frequency if self.curve.parameter == "frequency" else self.level

    def peak(self, output: int) -> "HighestResponse":
        """Find the highest response of an output."""
        peak = find_peak(self.parameter, np.abs(self.response[output]), float(self.damping[output]))
        return replace(peak, at_end=peak.at_end or not self.complete)


@dataclass(frozen=True, kw_only=True)
class HighestResponse:
    """The highest response of a curve; numbers are NaN if there is no curve.

    Parameters
    ----------
    parameter
        Frequency [Hz] or level [-] of the peak.
    amplitude
        Amplitude of the peak [SI].
    damping
        Equivalent damping ratio [-].
    at_end
        Whether the peak is at an end of the curve, or the curve is incomplete: the response may be larger outside.
    """

    parameter: float
    amplitude: float
    damping: float
    at_end: bool


def find_peak(parameter: Values, amplitude: Values, damping: float) -> HighestResponse:
    """Find the highest point of a curve, refined by the parabola through it and its neighbours except at a fold."""
    if not len(parameter):
        return HighestResponse(parameter=np.nan, amplitude=np.nan, damping=np.nan, at_end=False)
    top = int(np.argmax(amplitude))
    at_end = top in {0, len(amplitude) - 1}
    place, height = float(parameter[top]), float(amplitude[top])
    near = slice(max(top - 1, 0), top + 2)
    step = np.diff(parameter[near])
    if not at_end and ((step > 0).all() or (step < 0).all()):
        try:
            peak = interpolated_peak(parameter[near], amplitude[near])
            place, height = peak.angular_frequency, peak.amplitude
        except NoPeakError:
            pass  # at a corner of the curve, the highest point is the peak
    return HighestResponse(parameter=place, amplitude=height, damping=damping, at_end=at_end)


@stage("curve of a parameter point")
def point_curve(model: SolveModel, curve: RequestedCurve) -> PointCurve:
    """Compute a curve as `stickslip solve` does, and summarise it.

    Parameters
    ----------
    model
        Model of the point.
    curve
        Request of the case.
    """
    outputs = model.outputs
    try:
        branch = response_curve(model.system, curve, model.harmonics, model.n_sample)
    except ComputationFailed as error:
        none, no_response = np.zeros(0), np.zeros((len(outputs), 0), dtype=np.complex128)
        return PointCurve(
            curve=curve, frequency=none, level=none, response=no_response, truncation_error=none,
            damping=np.full(len(outputs), np.nan), stop_message=str(error), complete=False,
        )  # fmt: skip
    if model.tolerance is not None:
        branch = refine_curve(
            model.system, curve, branch, model.harmonics, model.n_sample, model.tolerance, model.output_rows
        )
    return summarise_curve(model, curve, branch)


def summarise_curve(model: SolveModel, curve: RequestedCurve, branch: ResponseBranch) -> PointCurve:
    """Make the stored result of a curve."""
    balance = HarmonicBalance(system=model.system, n_harmonic=model.harmonics + 1, n_sample=model.n_sample)
    solved, harmonic = SolvedCurve(curve=curve, branch=branch, model=model), find_main_harmonic(model.system)
    damping = []
    for output in model.outputs:
        peak = solved.peak(output, harmonic)
        at_peak, state = branch.balance_at(balance, peak), branch.state(balance, peak)
        damping.append(energy_balance(at_peak, state).loss_factor / 2)
    return PointCurve(
        curve=curve,
        frequency=branch.frequency,
        level=solved.level,
        response=np.array([solved.output(output)[:, harmonic] for output in model.outputs]),
        truncation_error=solved.error("truncation_error"),
        damping=np.array(damping),
        stop_message=branch.stop_message,
        complete=branch.stop_reason is StopReason.REACHED,
    )
