r"""Frequency and damping of one measured and one predicted peak, and their difference expected for a complete model.

A resonance is estimated from a few points, often three, by `metric.response.fit_resonance`, as a function r of the
logarithms of their moduli. Even for a complete model its error is uncertain, for two reasons:

- the covariance :math:`S` of the features :math:`f = F / X` (`noise.whitening`): noise, jitter of the repeats,
  friction histories, numerical error. With :math:`\mathrm{d} \ln |X| = -\Re(\bar f \, \mathrm{d} f) / |f|^2` and
  J the derivatives of r with respect to f through these logarithms, the contribution is :math:`J S J^T`;
- the estimate: with friction a peak differs from the parabola of a single mode, so that the result depends on the
  position of the points. The contribution is that of noise as large as the deviations of measured and predicted peak
  from a parabola through their points and one more on either side. It is zero for a single mode.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.feature.jump import find_curve_jumps
from correlation.feature.vector import FeatureVector
from correlation.metric.curve_peak import CurvePeak
from correlation.metric.response import find_peak, fit_resonance, measure_bend
from correlation.noise.covariance import Whitening
from correlation.prediction import Points

Coefficients = Complex[NDArray[np.complex128], " f"]
Vector = Float[NDArray[np.float64], " f"]
Mask = Bool[NDArray[np.bool_], " f"]
Rows = Int[NDArray[np.int64], " f"]

#: Step of differences with respect to the logarithm of a modulus [-]; resonances are smooth on this scale, and accurate
#: to 1e-10.
STEP = 1e-5
#: Least number of common points for which the predicted peak is evaluated at the points of the measured one.
MIN_COMMON_POINTS = 3
#: Number of coefficients of a parabola.
PARABOLA = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class PeakCurve:
    """Values of one sensor at one level over the force, and the range of one peak.

    Parameters
    ----------
    frequency
        Frequencies, ascending, shape (f,) [Hz].
    value
        Values, shape (f,); NaN where there is none.
    span
        Mask of the points between the valleys of the peak, shape (f,).
    """

    frequency: Vector
    value: Coefficients
    span: Mask

    @classmethod
    def around(cls, peak: CurvePeak | None, frequency: Vector, value: Coefficients) -> "PeakCurve":
        """A curve with the range of a peak; without a peak the range is empty."""
        low, high = (np.inf, -np.inf) if peak is None else (peak.low, peak.high)
        return cls(frequency=frequency, value=value, span=(frequency >= low) & (frequency <= high))

    def find_points(self, beside: int = 0) -> Mask:
        """Mask of the points of the peak, and `beside` more on either side, shape (f,); empty without a value.

        Raises
        ------
        CampaignError
            The largest value is at an end.
        """
        there, points = self.span & np.isfinite(self.value), np.zeros(len(self.frequency), dtype=bool)
        if there.any():
            points[there] = find_peak(self.frequency[there], self.value[there], beside)
        return points


@dataclass(frozen=True, kw_only=True)
class PeakReading:
    """Frequencies [Hz] and damping ratios [-] of a measured and a predicted peak, and deviations of their differences.

    Predicted values are NaN if the model has no peak in the range.
    """

    frequency: float
    damping: float
    predicted_frequency: float
    predicted_damping: float
    frequency_deviation: float
    damping_deviation: float


def read_peaks(
    measured: PeakCurve, predicted: PeakCurve, rows: Rows, features: FeatureVector, whitening: Whitening
) -> PeakReading:
    """Estimate frequency and damping of both peaks.

    Parameters
    ----------
    measured, predicted
        Curves of one sensor around the peaks of one mode.
    rows
        Their rows among the points of the features, shape (f,).
    features, whitening
        Features, and their covariance.

    Raises
    ------
    CampaignError
        The measured peak is not that of a single mode.
    """
    frequency, value = measured.frequency, measured.value
    chosen, own = _select_points(measured, predicted)
    resonance = fit_resonance(frequency, value, chosen)
    slopes = _compute_slopes(frequency, value, chosen)
    try:
        model = fit_resonance(frequency, predicted.value, own) if own.any() else (np.nan, np.nan)
    except CampaignError:
        model = (np.nan, np.nan)
    logarithm = _differentiate_modulus(value, features, rows)
    numbers = _locate_numbers(features, rows)
    noise = ((logarithm * whitening.deviation[numbers]) ** 2).sum(axis=0)
    variance = slopes**2 @ noise
    shared = whitening.shared(numbers.ravel()).reshape(*numbers.shape, -1)
    variance += ((slopes @ (logarithm[:, :, None] * shared).sum(axis=0)) ** 2).sum(axis=1)
    variance += (slopes**2).sum(axis=1) * _compute_reading_error(measured, predicted, noise)
    deviation = np.sqrt(variance)
    return PeakReading(
        frequency=float(resonance[0]),
        damping=float(resonance[1]),
        predicted_frequency=float(model[0]),
        predicted_damping=float(model[1]),
        frequency_deviation=float(deviation[0]),
        damping_deviation=float(deviation[1]),
    )


def measure_noise(value: Coefficients, rows: Rows, features: FeatureVector, whitening: Whitening) -> Vector:
    """Standard deviation of moduli by the independent noise of points, shape (f,) [as the values].

    Parameters
    ----------
    value, rows
        Values over the force, and their rows among the points of the features, shape (f,).
    features, whitening
        Features, and their covariance.
    """
    logarithm = _differentiate_modulus(value, features, rows)
    return np.asarray(
        np.abs(value) * np.linalg.norm(logarithm * whitening.deviation[_locate_numbers(features, rows)], axis=0)
    )


def choose_upper_branch(
    points: Points, value: Coefficients, rows: Int[NDArray[np.int64], " f"]
) -> Int[NDArray[np.int64], " f"]:
    """Rows in ascending frequency; where two sweeps have a row, the one with the larger amplitude."""
    order = rows[np.lexsort([-np.abs(value[rows]), points.frequency[rows]])]
    return np.asarray(order[np.unique(points.frequency[order], return_index=True)[1]])


def has_jump_at_peak(points: Points, curve: PeakCurve, rows: Rows, sweeps: tuple[int, ...]) -> bool:
    """Whether the points of a peak are on one of two branches, or next to a jump of the only sweep."""
    try:
        peak = np.flatnonzero(curve.find_points())
    except CampaignError:
        return False
    if not len(peak):
        return False
    beside = np.arange(peak.min() - 1, peak.max() + 1)
    # A step over a gap between two bands does not count.
    own = np.where(curve.span, curve.value, np.nan)
    steps = find_curve_jumps(curve.frequency, own) if len(sweeps) < 2 else beside[:0]
    return bool(np.isin(steps, beside).any() or points.sweep[rows[peak]].any())


def _select_points(measured: PeakCurve, predicted: PeakCurve, beside: int = 0) -> tuple[Mask, Mask]:
    """Masks of the points of a measured and a predicted peak, shape (f,) each; the latter empty without a peak."""
    chosen = measured.find_points(beside)
    try:
        own = predicted.find_points(beside)
    except CampaignError:
        return chosen, np.zeros(len(chosen), dtype=bool)
    # With friction the damping depends on the choice of points: use the same ones if enough of them are common.
    same = chosen & np.isfinite(predicted.value)
    return chosen, same if (same & own).sum() >= MIN_COMMON_POINTS else own


def _compute_slopes(frequency: Vector, value: Coefficients, chosen: Mask) -> Float[NDArray[np.float64], "2 f"]:
    """Derivatives of frequency [Hz] and damping ratio [-] with respect to the logarithm of each modulus."""
    slopes = np.zeros((2, len(value)))
    for point in np.flatnonzero(chosen):
        ends = []
        for step in (STEP, -STEP):
            moved = np.array(value)
            moved[point] *= np.exp(step)
            ends.append(fit_resonance(frequency, moved, chosen))
        slopes[:, point] = (np.array(ends[0]) - ends[1]) / (2 * STEP)
    return slopes


def _locate_numbers(features: FeatureVector, rows: Int[NDArray[np.int64], " f"]) -> Int[NDArray[np.int64], "2 f"]:
    """Indices of real and imaginary part of some rows among all numbers, shape (2, f); the same twice for a modulus."""
    imaginary = len(features.points) + np.searchsorted(np.flatnonzero(~features.real_only), rows)
    return np.array([rows, np.where(features.real_only[rows], rows, imaginary)])


def _differentiate_modulus(
    value: Coefficients, features: FeatureVector, rows: Int[NDArray[np.int64], " f"]
) -> Float[NDArray[np.float64], "2 f"]:
    """Derivatives of the logarithm of |X| with respect to real and imaginary part of F / X, shape (2, f)."""
    inverse = features.points.level[rows] / value
    parts = np.array([inverse.real, inverse.imag])
    parts[:, features.real_only[rows]] = np.array([[1.0], [0.0]]) * np.abs(inverse[features.real_only[rows]])
    return np.asarray(-parts / np.abs(inverse) ** 2)


def _compute_reading_error(measured: PeakCurve, predicted: PeakCurve, noise: Vector) -> float:
    """Mean square deviation of measured and predicted peaks from parabolas, relative to their moduli [-].

    The contribution of noise with the given relative variance is subtracted, since it is counted already.
    """
    chosen, own = _select_points(measured, predicted, beside=1)
    if not own.any():
        return 0.0
    bend = measure_bend(measured.frequency, measured.value, chosen)
    model = measure_bend(predicted.frequency, predicted.value, own)
    same = bool((chosen == own).all())
    square = np.mean((model - bend) ** 2) if same else np.mean(model**2) + np.mean(bend**2)
    left = 1 - PARABOLA / chosen.sum()
    return max(float(square - left * noise[chosen].mean()), 0.0)
