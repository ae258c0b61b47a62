r"""Derivatives of response curves by parameters of a case, and the resulting spread to first order.

The matrices, loads and joint parameters are differentiated by central differences, which are exact to round-off where
they are linear or quadratic in the parameter; the responses by the implicit function theorem (`hbsolve.sensitivity`).
With the amplitude A of an output and its complex response q,

.. math:: \frac{dA}{dp} = \frac{\mathrm{Re}(\bar q \, dq/dp)}{A}, \qquad
          s_A^2 = \sum_i \left( \frac{dA}{dp_i} s_i \right)^2 .

At the peak of a curve the change of its frequency does not contribute to dA, since dA / dOmega is zero there; the
change of the frequency follows from the parabola through the highest points.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.model import DERIVATIVE, Model, Sensor
from correlation.model_solver import Tangent
from diagnosis.fit.tangent import differentiate
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.model_rates import ModelParameter
from hbsolve.sensitivity import sensitivity
from pipeline.progress import SilentProgress
from study.case.setup import read_case
from study.kind.registry import OpenCase
from study.run_context import RunContext
from study.solve.curve import RequestedCurve
from study.solve.model import SolveModel
from study.solve.result import SolvedCurve, find_main_harmonic
from study.spread.uncertain import Uncertain
from study.sweep.curve import find_peak
from study.sweep.parameter import vary

Real = NDArray[np.float64]

#: Relative change of the amplitudes for finite differences of the peak; the parabola is smooth over far larger changes.
SMALL_CHANGE = 1e-5


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveSensitivity:
    """Derivatives of one curve.

    Parameters
    ----------
    response
        Derivative of the complex response of each output at fixed frequency and level, shape (d, n_output, p)
        [SI / unit of the parameter]; NaN for a parameter without derivatives, see `model_tangents`.
    amplitude
        Derivative of the amplitude, shape (d, n_output, p).
    peak
        Derivatives of the frequency (or level) [Hz, -] and the amplitude [SI] of the peak, shape (d, n_output, 2).
    """

    response: Complex[NDArray[np.complex128], "d output p"]
    amplitude: Float[Real, "d output p"]
    peak: Float[Real, "d output 2"]


def model_tangents(opened: OpenCase, uncertain: Uncertain, run: RunContext) -> list[Tangent | None]:
    """Differentiate the model by each parameter at the means; None for one that moves joints, sensors or a base.

    Derivatives of gains are relative to the gains.
    """
    quiet = replace(run, progress=SilentProgress())

    def compose(values: Float[Real, " d"]) -> Model:
        return read_case(vary(opened, uncertain.at(values.tolist())), run=quiet).model

    unbounded = [(-np.inf, np.inf)] * len(uncertain.parameters)
    gain = {item.name: item.gain for item in compose(uncertain.mean).sensors}
    return [
        tangent and replace(tangent, gain={name: rate / gain[name] for name, rate in tangent.gain.items()})
        for tangent in differentiate(compose, uncertain.mean, uncertain.deviation, unbounded)
    ]


def differentiate_curve(
    model: SolveModel,
    curve: RequestedCurve,
    branch: ResponseBranch,
    tangents: Sequence[Tangent | None],
    report: Callable[[float, float], None] | None = None,
) -> CurveSensitivity:
    """Compute the derivatives at all points of a curve.

    Parameters
    ----------
    model
        Model at the means.
    curve, branch
        Request of the case, and points of the curve.
    tangents
        Derivatives of the model, from `model_tangents`.
    report
        Function that receives the progress along the curve.
    """
    balance = HarmonicBalance(system=model.system, n_harmonic=model.harmonics + 1, n_sample=model.n_sample)
    solved, harmonic = SolvedCurve(curve=curve, branch=branch, model=model), find_main_harmonic(model.system)
    nominal = np.array([solved.output(output)[:, harmonic] for output in model.outputs])
    rates = [ModelParameter() if item is None else item.jointed for item in tangents]
    response = np.empty((len(tangents), *nominal.shape), dtype=np.complex128)
    for point in range(len(branch.frequency)):
        state = branch.state(balance, point)
        moved = sensitivity(branch.balance_at(balance, point), state, rates)[:, harmonic]
        for number, output in enumerate(model.outputs):
            turn = 1j * harmonic * state.angular_frequency
            times = turn ** DERIVATIVE[output.quantity] * np.exp(-turn * output.delay)
            response[:, number, point] = times * (moved @ output.row)
        if report is not None:
            report(point + 1, len(branch.frequency))
    response += _compute_change_by_gain(tangents, model.outputs, nominal)
    response[[item is None for item in tangents]] = np.nan
    amplitude = (nominal.conj() * response).real / np.abs(nominal)
    peak = np.array(
        [[_compute_peak_slope(solved.parameter, np.abs(q), slope) for q, slope in zip(nominal, entry, strict=True)]
         for entry in amplitude]
    ).reshape(len(tangents), len(nominal), 2)  # fmt: skip
    return CurveSensitivity(response=response, amplitude=amplitude, peak=peak)


def _compute_change_by_gain(
    tangents: Sequence[Tangent | None], outputs: Sequence[Sensor], nominal: Complex[NDArray[np.complex128], "output p"]
) -> Complex[NDArray[np.complex128], "d output p"]:
    """Compute the change of the outputs by the gains of sensors, which their rows contain."""
    names = [output.name for output in outputs]
    rates = np.array([[0.0 if item is None else item.gain.get(name, 0.0) for name in names] for item in tangents])
    return np.asarray(rates[:, :, None] * nominal[None])


def _compute_peak_slope(
    along: Float[Real, " p"], amplitude: Float[Real, " p"], slope: Float[Real, " p"]
) -> tuple[float, float]:
    """Compute the derivatives of position and amplitude of the peak from those of the amplitudes at all points."""
    top = int(np.argmax(amplitude))
    if not np.isfinite(slope[top]):
        return np.nan, np.nan
    size = SMALL_CHANGE * amplitude[top] / max(float(np.abs(slope).max()), np.finfo(float).tiny)
    low, high = (find_peak(along, amplitude + side * size * slope, 0.0) for side in (-1, 1))
    if low.at_end or high.at_end:
        return np.nan, float(slope[top])
    return (high.parameter - low.parameter) / (2 * size), (high.amplitude - low.amplitude) / (2 * size)
