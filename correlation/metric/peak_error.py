r"""Errors of a model's resonances, beside what noise, friction histories and the reading of a peak explain.

A resonance is read off a few points, often three, by `metric.response.fit_resonance`: a function r of the logarithms of
their moduli. Two things make its error uncertain although nothing is missing:

- the covariance :math:`S` of the features :math:`f = F / X` (`noise.whitening`): noise, jitter of the repeats,
  friction histories, numerical error. With :math:`\mathrm{d} \ln |X| = -\Re(\bar f \, \mathrm{d} f) / |f|^2` and
  J the derivatives of r by these logarithms and then by the numbers of f, its share is :math:`J S J^T`;
- the reading: friction bends a peak away from the parabola that one mode has, and where the points lie on it decides
  what is read. Its share is that of noise as large as what measured and predicted peaks differ by from a parabola
  through their points and one more on either side. For a single mode that is nothing.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.errors import CampaignError
from correlation.feature.jump import find_curve_jumps
from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.response import find_peak, fit_resonance, measure_bend
from correlation.noise.covariance import Whitening
from correlation.prediction import Points

Coefficients = Complex[NDArray[np.complex128], " k"]
Vector = Float[NDArray[np.float64], " m"]
Mask = Bool[NDArray[np.bool_], " f"]

#: Step of a difference by the logarithm of a modulus [-]; resonances are smooth far beyond, and known to 1e-10.
STEP = 1e-5
#: A model's peak is read off the points of the measured one if it has so many of them in common.
ENOUGH = 3
#: Numbers of a parabola.
PARABOLA = 3
#: A peak as broad as with a larger damping ratio is not that of one mode, which a parabola could tell [-].
MOST_DAMPED = 0.3


@dataclass(frozen=True, kw_only=True)
class PeakError:
    """Resonance of a configuration at a level, measured and predicted at the same frequencies.

    Parameters
    ----------
    free, level
        Configuration and level [-, N].
    sensor
        The motion that it is taken from.
    frequency, predicted_frequency
        [Hz].
    frequency_deviation
        Standard deviation of their difference though the model lacks nothing [Hz].
    damping, predicted_damping, damping_deviation
        The same of the damping ratio [-].
    """

    free: bool
    level: float
    sensor: str
    frequency: float
    predicted_frequency: float
    frequency_deviation: float
    damping: float
    predicted_damping: float
    damping_deviation: float

    @property
    def frequency_error(self) -> float:
        """How much too high the prediction is, relative [-]."""
        return self.predicted_frequency / self.frequency - 1

    @property
    def damping_error(self) -> float:
        """How much too damped the prediction is, relative [-]."""
        return self.predicted_damping / self.damping - 1


def compute_peak_errors(
    observed: Observation,
    predicted: Coefficients,
    features: FeatureVector,
    whitening: Whitening,
    sweeps: tuple[int, ...] = (),
) -> tuple[PeakError, ...]:
    """Resonances by configuration and level, as far as the band holds one; none that is no peak, or ends in a jump.

    Parameters
    ----------
    observed
        Measurements, k points. What is read is the inverse of the mean of F / X: the mean of X over repeats whose
        resonances are a little apart is lower and broader than each of them.
    predicted
        Predicted coefficients at the same points, shape (k,).
    features, whitening
        Features and covariance of the same points, from which the deviations follow.
    sweeps
        Directions in which the structure was swept.
    """
    points, found = observed.points, []
    mean = _per_level(points, features.values(features.of_repeats(observed.repeat, observed.taken)))
    predicted = _per_level(points, predicted)
    for free, level in sorted({(bool(a), float(b)) for a, b in zip(points.free, points.level, strict=True)}):
        here = features.inverse & (points.free == free) & (points.level == level)
        if not here.any():
            continue
        sensor = str(points.sensor[here][np.argmax(np.abs(mean[here]))])
        rows = choose_upper_branch(points, mean, np.flatnonzero(here & (points.sensor == sensor)))
        frequency, value = points.frequency[rows], mean[rows]
        try:
            if any(has_jump_at_peak(points, of, rows, sweeps) for of in (mean, predicted)):
                continue
            chosen, own = _points(frequency, value, predicted[rows])
            measured = fit_resonance(frequency, value, chosen)
            model = fit_resonance(frequency, predicted[rows], own) if own.any() else (np.nan, np.nan)
            slopes = _slopes(frequency, value, chosen)
        except CampaignError:
            continue
        if measured[1] > MOST_DAMPED:
            continue
        logarithm = _by_number(value, features, rows)
        numbers = _numbers(features, rows)
        noise = ((logarithm * whitening.deviation[numbers]) ** 2).sum(axis=0)
        variance = slopes**2 @ noise
        shared = whitening.shared(numbers.ravel()).reshape(*numbers.shape, -1)
        variance += ((slopes @ (logarithm[:, :, None] * shared).sum(axis=0)) ** 2).sum(axis=1)
        variance += (slopes**2).sum(axis=1) * _reading(frequency, value, predicted[rows], noise)
        deviation = np.sqrt(variance)
        found.append(
            PeakError(
                free=free,
                level=level,
                sensor=sensor,
                frequency=float(measured[0]),
                predicted_frequency=float(model[0]),
                frequency_deviation=float(deviation[0]),
                damping=float(measured[1]),
                predicted_damping=float(model[1]),
                damping_deviation=float(deviation[1]),
            )
        )
    return tuple(found)


def find_unread_peaks(
    observed: Observation,
    predicted: Coefficients,
    features: FeatureVector,
    sweeps: tuple[int, ...] = (),
    level_unit: str = "N",
) -> tuple[str, ...]:
    """Why a resonance was not read, of each configuration and level whose peak ends in a jump, in words."""
    points, reasons = observed.points, []
    mean = _per_level(points, features.values(features.of_repeats(observed.repeat, observed.taken)))
    predicted = _per_level(points, predicted)
    for free, level in sorted({(bool(a), float(b)) for a, b in zip(points.free, points.level, strict=True)}):
        here = features.inverse & (points.free == free) & (points.level == level)
        if not here.any():
            continue
        sensor = points.sensor[here][np.argmax(np.abs(mean[here]))]
        rows = choose_upper_branch(points, mean, np.flatnonzero(here & (points.sensor == sensor)))
        both = {"measured": mean, "predicted": predicted}
        whose = [name for name, of in both.items() if has_jump_at_peak(points, of, rows, sweeps)]
        if whose:
            reasons.append(
                f"the {' and the '.join(whose)} peak of {name_configuration(free)} at {level:g} {level_unit} ends "
                "in a jump, or the sweeps differ there: neither of two branches shows a damping ratio by its width"
            )
    return tuple(reasons)


def _per_level(points: Points, value: Coefficients) -> Coefficients:
    """Coefficients times level over force: a peak is that of the compliance, also where the response was controlled."""
    return np.asarray(value * (points.level / points.force))


def choose_upper_branch(
    points: Points, value: Coefficients, rows: Int[NDArray[np.int64], " f"]
) -> Int[NDArray[np.int64], " f"]:
    """Of rows at one frequency in two sweeps the one with the larger amplitude; rising in frequency."""
    order = rows[np.lexsort([-np.abs(value[rows]), points.frequency[rows]])]
    return np.asarray(order[np.unique(points.frequency[order], return_index=True)[1]])


def has_jump_at_peak(
    points: Points, value: Coefficients, rows: Int[NDArray[np.int64], " f"], sweeps: tuple[int, ...]
) -> bool:
    """Whether the points of a peak are on one of two branches, or beside a jump of the only sweep."""
    there = rows[np.isfinite(value[rows])]
    try:
        peak = np.flatnonzero(find_peak(points.frequency[there], value[there]))
    except CampaignError:
        return False
    beside = np.arange(peak.min() - 1, peak.max() + 1)
    steps = find_curve_jumps(value[there]) if len(sweeps) < 2 else beside[:0]
    return bool(np.isin(steps, beside).any() or points.sweep[there][peak].any())


def _points(frequency: Vector, value: Coefficients, predicted: Coefficients, beside: int = 0) -> tuple[Mask, Mask]:
    """Which points a measured and a predicted peak are read off, shape (f,) each; none if nothing is predicted."""
    chosen, there = find_peak(frequency, value, beside), np.isfinite(predicted)
    own = np.zeros(len(frequency), dtype=bool)
    if there.any():
        own[there] = find_peak(frequency[there], predicted[there], beside)
    # Other points of a bent peak would read another damping: the same if the peaks have enough of them in common.
    same = chosen & there
    return chosen, same if (same & own).sum() >= ENOUGH else own


def _slopes(frequency: Vector, value: Coefficients, chosen: Mask) -> Float[NDArray[np.float64], "2 f"]:
    """Derivatives of frequency [Hz] and damping ratio [-] by the logarithm of the modulus of each point."""
    slopes = np.zeros((2, len(value)))
    for point in np.flatnonzero(chosen):
        ends = []
        for step in (STEP, -STEP):
            moved = np.array(value)
            moved[point] *= np.exp(step)
            ends.append(fit_resonance(frequency, moved, chosen))
        slopes[:, point] = (np.array(ends[0]) - ends[1]) / (2 * STEP)
    return slopes


def _numbers(features: FeatureVector, rows: Int[NDArray[np.int64], " f"]) -> Int[NDArray[np.int64], "2 f"]:
    """Where the real and the imaginary parts of some rows stand among all numbers, shape (2, f); once for a modulus."""
    imaginary = len(features.points) + np.searchsorted(np.flatnonzero(~features.real_only), rows)
    return np.array([rows, np.where(features.real_only[rows], rows, imaginary)])


def _by_number(
    value: Coefficients, features: FeatureVector, rows: Int[NDArray[np.int64], " f"]
) -> Float[NDArray[np.float64], "2 f"]:
    """Derivatives of the logarithm of |X| by the real and the imaginary part of F / X, shape (2, f)."""
    inverse = features.points.level[rows] / value
    parts = np.array([inverse.real, inverse.imag])
    parts[:, features.real_only[rows]] = np.array([[1.0], [0.0]]) * np.abs(inverse[features.real_only[rows]])
    return np.asarray(-parts / np.abs(inverse) ** 2)


def _reading(frequency: Vector, value: Coefficients, predicted: Coefficients, noise: Vector) -> float:
    """Mean square of what measured and predicted peaks differ by from parabolas, relative to their moduli [-].

    Noise, whose relative variance is given, departs from a parabola, too, and is counted already.
    """
    chosen, own = _points(frequency, value, predicted, beside=1)
    if not own.any():
        return 0.0
    measured, model = measure_bend(frequency, value, chosen), measure_bend(frequency, predicted, own)
    same = bool((chosen == own).all())
    square = np.mean((model - measured) ** 2) if same else np.mean(model**2) + np.mean(measured**2)
    left = 1 - PARABOLA / chosen.sum()
    return max(float(square - left * noise[chosen].mean()), 0.0)
