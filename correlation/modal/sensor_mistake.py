"""Swapped sensors, or a sensor with reversed sign, found by comparing measured mode shapes with those of a model.

A sensor mistake is the same in all modes, an error of the model is not. A single change of the sensors that makes
nearly all shapes agree with those of the model at similar frequencies is therefore the likely cause.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.modal.assurance import Shapes, compute_modal_assurance
from correlation.modal.pairing import score_pairs

Frequencies = Float[NDArray[np.float64], " m"]

#: Least mean score or MAC of shapes that agree, and largest remaining share of 1 - score after a suspected change [-].
AGREES, AFTER_CORRECTION = 0.9, 1 / 3
#: With more sensors than this only reversed ones are searched, since there are too many pairs.
MOST_SENSORS = 60


@dataclass(frozen=True, kw_only=True)
class SensorMistake:
    """A change of the sensors that corrects the shapes.

    Parameters
    ----------
    sensors
        Row of the sensor with reversed sign, or rows of both swapped sensors.
    before, after
        Mean MAC of the modes with those of the model, without and with the change [-].
    """

    sensors: tuple[int, ...]
    before: float
    after: float

    def correct(self, shapes: Shapes) -> Shapes:
        """Apply the change to shapes, shape (c, m)."""
        return _change(shapes, self.sensors)


def find_sensor_mistake(
    measured_frequency: Frequencies,
    measured: Shapes,
    model_frequency: Frequencies,
    model: Shapes,
    quantities: Sequence[str],
) -> SensorMistake | None:
    """The mistake that best explains the disagreement of shapes; None if they agree, or if none explains it.

    Parameters
    ----------
    measured_frequency, model_frequency
        Shape (n_measured,) and (n_model,) [Hz].
    measured, model
        Shapes at the same sensors, shape (c, n_measured) and (c, n_model).
    quantities
        Quantity of each sensor; only sensors of the same quantity are swapped.
    """
    if measured.shape[1] < 2 or len(measured) < 2 or not len(model_frequency):
        return None

    def compute_scores(shapes: Shapes) -> tuple[float, float]:
        assurance = compute_modal_assurance(shapes, model)
        score = score_pairs(assurance, measured_frequency, model_frequency)
        best = score.argmax(axis=1)
        rows = np.arange(len(best))
        return float(score[rows, best].mean()), float(assurance[rows, best].mean())

    score, before = compute_scores(measured)
    if score > AGREES:
        return None
    trials = [(compute_scores(_change(measured, sensors)), sensors) for sensors in _list_changes(quantities)]
    (corrected, after), sensors = max(trials, key=lambda trial: trial[0][0])
    if after < AGREES or 1 - corrected > AFTER_CORRECTION * (1 - score):
        return None
    return SensorMistake(sensors=sensors, before=before, after=after)


def _list_changes(quantities: Sequence[str]) -> Iterator[tuple[int, ...]]:
    count = len(quantities)
    yield from ((row,) for row in range(count))
    if count <= MOST_SENSORS:
        yield from ((i, j) for i, j in combinations(range(count), 2) if quantities[i] == quantities[j])


def _change(shapes: Shapes, sensors: tuple[int, ...]) -> Shapes:
    changed = np.array(shapes)
    changed[list(sensors)] = -shapes[list(sensors)] if len(sensors) == 1 else shapes[list(sensors[::-1])]
    return changed
