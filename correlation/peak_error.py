"""Errors of a model's resonances, beside the scatter of the repeats."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Int
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.metric import resonance
from correlation.observation import Observation

Coefficients = Complex[NDArray[np.complex128], " k"]


@dataclass(frozen=True, kw_only=True)
class PeakError:
    """Resonance of a configuration at a level, measured and predicted at the same frequencies.

    Parameters
    ----------
    free, level
        Where [-, N].
    sensor
        The motion that it is taken from.
    frequency, predicted_frequency
        [Hz].
    frequency_deviation
        Standard deviation of the measured mean [Hz]; NaN from one repeat.
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


def peak_errors(observed: Observation, predicted: Coefficients) -> tuple[PeakError, ...]:
    """Resonances by configuration and level, as far as the band holds one.

    Parameters
    ----------
    observed
        Measurements; all repeats tell of the scatter, those taken of the mean.
    predicted
        At the same points, shape (k,).
    """
    points, found = observed.points, []
    fundamental = observed.motion & (points.harmonic == 1)
    for free, level in sorted({(bool(a), float(b)) for a, b in zip(points.free, points.level, strict=True)}):
        here = fundamental & (points.free == free) & (points.level == level)
        if not here.any():
            continue
        sensor = str(points.sensor[here][np.argmax(np.abs(observed.value[here]))])
        rows = np.flatnonzero(here & (points.sensor == sensor))
        error = _peak(observed, predicted, rows, free, level, sensor)
        if error is not None:
            found.append(error)
    return tuple(found)


def _peak(
    observed: Observation, predicted: Coefficients, rows: Int[NDArray[np.int64], " f"], free: bool, level: float,
    sensor: str,
) -> PeakError | None:  # fmt: skip
    frequency = observed.points.frequency[rows]
    there = np.isfinite(predicted[rows])
    try:
        measured = resonance(frequency, observed.value[rows])
        model = resonance(frequency[there], predicted[rows][there]) if there.any() else (np.nan, np.nan)
        each = [resonance(frequency, repeat) for repeat in observed.repeat[rows].T if np.isfinite(repeat).all()]
    except CampaignError:
        return None
    n = max(int(observed.count[rows].min()), 1)
    scatter = np.std(each, axis=0, ddof=1) / np.sqrt(n) if len(each) > 1 else np.full(2, np.nan)
    return PeakError(
        free=free,
        level=level,
        sensor=sensor,
        frequency=measured[0],
        predicted_frequency=model[0],
        frequency_deviation=float(scatter[0]),
        damping=measured[1],
        predicted_damping=model[1],
        damping_deviation=float(scatter[1]),
    )
