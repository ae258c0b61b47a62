"""Whether a model is close enough to a structure for a single missing effect to be identified.

If a measured resonance is far from all resonances of the calibrated model, a support, a mass or a unit is wrong, and
many effects could correct this one resonance. The same is true if the model has a resonance in the band and the
measurements have none. If calibration parameters are beyond their priors, they may stand in for the missing effect.

A band may contain several modes: every measured resonance is compared, not only the highest. A predicted resonance is
absent if no measured peak lies between the valleys on its two sides.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.feature.observation import Observation
from correlation.metric.curve_peak import CurvePeak, find_curve_peaks, find_own_peaks
from correlation.model import Model
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.fit.calibration import Fit
from fe.dense_modes import compute_dense_modes
from reduction.jointed_system import JointedSystem
from reduction.stuck import stick_at_rest

Sizes = Float[NDArray[np.float64], " n"]

#: Relative distance of a measured resonance from those of the model above which it is far. Set on development seeds
#: [-].
MAX_RESONANCE_ERROR = 0.1
#: Least ratio of a peak to both ends of its curve, and of a predicted peak to what was measured there. Set on
#: development seeds [-].
MIN_PEAK_OVER_ENDS, MIN_PEAK_OVER_MEASURED = 1.5, 3.0


class FarResonance(NamedTuple):
    """A measured resonance, and the nearest one of the model [Hz]."""

    configuration: str
    measured: float
    nearest: float

    @property
    def sentence(self) -> str:
        """The far resonance in a sentence."""
        off = 100 * (self.nearest / self.measured - 1)
        return (
            f"The model is not close enough to be diagnosed: the {self.configuration} structure has a resonance near "
            f"{self.measured:.4g} Hz, and the nearest one of the calibrated model, at {self.nearest:.4g} Hz, differs "
            f"by {off:+.2g} %."
        )


class AbsentPeak(NamedTuple):
    """A resonance of the model in a band whose measured responses only rise or only fall [Hz]."""

    configuration: str
    predicted: float
    lower: float
    upper: float

    @property
    def sentence(self) -> str:
        """The absent resonance in a sentence."""
        return (
            f"The model is not close enough to be diagnosed: the calibrated model has a resonance near "
            f"{self.predicted:.4g} Hz in the {self.configuration} structure, but the responses measured from "
            f"{self.lower:.4g} to {self.upper:.4g} Hz have none. Measure a wider band, or correct the model."
        )


def find_absent_peak(observed: Observation, predicted: Complex[NDArray[np.complex128], " k"]) -> AbsentPeak | None:
    """A predicted peak far above measured responses that are largest at an end of the band; None without such a peak.

    Parameters
    ----------
    observed
        Measurements; the lowest level of each configuration counts.
    predicted
        Predictions of the same readings, shape (k,).
    """
    for free, rows, curve in _list_curves(observed):
        size = _divide_by_force(observed, predicted)[rows]
        if len(rows) < 3 or not np.isfinite(size).all():
            continue
        top, end = int(np.argmax(size)), int(np.argmax(curve))
        frequency = observed.points.frequency[rows]
        if _shows_peak(frequency, size, curve):
            continue
        at_end = end in (0, len(curve) - 1) and curve[end] > MIN_PEAK_OVER_ENDS * curve[len(curve) - 1 - end]
        if at_end and size[top] > max(MIN_PEAK_OVER_ENDS * max(size[0], size[-1]), MIN_PEAK_OVER_MEASURED * curve[top]):
            name = name_configuration(free)
            return AbsentPeak(name, float(frequency[top]), float(frequency[0]), float(frequency[-1]))
    return None


def find_far_resonance(observed: Observation, model: Model) -> FarResonance | None:
    """The measured resonance that is farthest from those of a model, if it is far.

    Parameters
    ----------
    observed
        Measurements; the lowest level of each configuration counts.
    model
        Calibrated model. A resonance of its jointed structure lies between those without and with its contacts stuck.
    """
    result = []
    for free, measured in _list_peaks(observed):
        low, high = _bracket_frequencies(model.without_contacts().system if free else model.system)
        ends = np.where(measured < low, low, np.where(measured > high, high, measured))
        nearest = float(ends[np.argmin(np.abs(np.log(np.maximum(ends, 1e-300) / measured)))])
        result.append(FarResonance(name_configuration(free), measured, nearest))
    farthest = max(result, key=lambda item: abs(np.log(item.nearest / item.measured)), default=None)
    if farthest is None or abs(farthest.nearest / farthest.measured - 1) <= MAX_RESONANCE_ERROR:
        return None
    return farthest


def list_beyond_priors(fit: Fit) -> tuple[str, ...]:
    """Parameters that a fit moves beyond their priors, such as "kt x 1.5" or "shift of lid = 0.002 m".

    A parameter is listed if it is at a bound. If all together are further from their prior centres than chance
    explains, those outside their own 95 % interval are listed too, or at least the furthest one.

    Parameters
    ----------
    fit
        Fit of calibration parameters.
    """
    unknowns, first = fit.unknowns, fit.unknowns.n_start
    residuals = np.abs(unknowns.prior_residuals(fit.values))[first:]
    least = min(TWO_SIDED_95, residuals.max(initial=0.0)) if fit.is_beyond_priors else np.inf
    every = zip(unknowns.names, unknowns.parameters, unknowns.prior[first:], fit.values[first:], residuals, strict=True)
    return tuple(
        parameter.describe(name, value)
        for name, parameter, prior, value, residual in every
        if np.isfinite(prior) and (parameter.is_at_bound(value) or residual >= least)
    )


def describe_beyond_priors(beyond_priors: Sequence[str], effect: str = "") -> str:
    """Sentence about the parameters beyond their priors, with an added effect if one is given."""
    model = f"Even with {effect} the model" if effect else "The model"
    return (
        f"{model} differs from the measurements by more than its priors allow, in {' and '.join(beyond_priors)}, and "
        "no known effect explains the residual. As long as this holds, a missing effect cannot be identified."
    )


def _list_peaks(observed: Observation) -> Iterator[tuple[bool, float]]:
    """Configuration and frequency of the peaks of each curve [Hz]."""
    for free, rows, curve in _list_curves(observed):
        for peak in _find_clear_peaks(observed.points.frequency[rows], curve):
            yield free, peak.frequency


def _find_clear_peaks(frequency: Sizes, curve: Sizes) -> list[CurvePeak]:
    """Peaks that are far above the valleys, or band ends, on both sides."""
    clear = []
    for peak in find_own_peaks(frequency, curve):
        height, ends = peak.shape[0].real, np.interp([peak.low, peak.high], frequency, curve)
        # A higher end is on the flank of another mode, with a deep valley before it.
        if ((height > MIN_PEAK_OVER_ENDS * ends) | (height <= ends)).all():
            clear.append(peak)
    return clear


def _shows_peak(frequency: Sizes, predicted: Sizes, measured: Sizes) -> bool:
    """Whether there is a measured peak between the valleys of the highest predicted one."""
    top = frequency[np.argmax(predicted)]
    own = [peak for peak in find_curve_peaks(frequency, predicted[None].astype(complex)) if peak.frequency == top]
    return any(one.low < peak.frequency < one.high for one in own for peak in _find_clear_peaks(frequency, measured))


def _list_curves(
    observed: Observation,
) -> Iterator[tuple[bool, NDArray[np.int64], Sizes]]:
    """For each configuration: rows of the sensor that moves most at the lowest level, and its amplitude per force."""
    points = observed.points
    size = _divide_by_force(observed, observed.value)
    seen = observed.motion & (points.harmonic == 1) & np.isfinite(size)
    for free in np.unique(points.free[seen]).tolist():
        own = seen & (points.free == free)
        own &= points.level == points.level[own].min()
        strongest = np.flatnonzero(own)[np.argmax(size[own])]
        own &= points.sensor == points.sensor[strongest]
        # Code 0 means that both sweeps coincide; there the upward sweep is continued.
        sweep = int(points.sweep[strongest]) or 1
        own &= np.isin(points.sweep, (0, sweep))
        rows = np.flatnonzero(own)[np.argsort(points.frequency[own])]
        yield bool(free), rows, size[rows]


def _divide_by_force(
    observed: Observation, value: Complex[NDArray[np.complex128], " k"]
) -> Float[NDArray[np.float64], " k"]:
    """Amplitude of readings per unit of force, or the amplitude where no force was recorded, shape (k,)."""
    force = observed.points.force
    return np.asarray(np.abs(value) / np.where(force > 0, force, 1.0))


def _bracket_frequencies(
    system: JointedSystem,
) -> tuple[Float[NDArray[np.float64], " r"], Float[NDArray[np.float64], " r"]]:
    """Natural frequencies without contacts and with all contacts stuck: lower and upper limit of each mode [Hz]."""
    low, high = (
        compute_dense_modes(system.mass, stiffness).frequency
        for stiffness in (system.stiffness, stick_at_rest(system.stiffness, system.joints))
    )
    return low, np.maximum(low, high)
