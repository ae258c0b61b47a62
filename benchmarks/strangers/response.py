"""Predictions of a model by harmonic balance, for planning tests, never for measuring."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from correlation.model import Model, Sensor
from correlation.prediction import Points, Prediction, Predictor

Rows = list[tuple[bool, float, float, str, int]]


def points_of(rows: Rows) -> Points:
    """Points from rows (free, level [N], frequency [Hz], sensor, harmonic)."""
    free, level, frequency, sensor, harmonic = zip(*rows, strict=True)
    return Points(
        free=np.array(free), level=np.array(level), frequency=np.array(frequency), sensor=np.array(sensor),
        harmonic=np.array(harmonic),
    )  # fmt: skip


def predict(
    model: Model,
    points: Points,
    before: Prediction | None = None,
    slider: Callable[..., NDArray[np.float64]] | None = None,
) -> Prediction:
    """Predict steady states, from sliders at rest by default."""
    return Predictor(points=points, slider=slider).predict(model, before)


def amplitude(
    model: Model, place: str, levels: Sequence[float], frequencies: Sequence[float], *, free: bool
) -> NDArray[np.float64]:
    """Displacement of a place per newton, shape (level, frequency) [m/N]; zero without a steady state."""
    probe = model.without_contacts() if free else model
    probe = Model(**{**vars(probe), "sensors": (Sensor(name="probe", row=model.places[place]),)})
    points = points_of([(False, level, f, "probe", 1) for level in levels for f in frequencies])
    value = np.nan_to_num(np.abs(predict(probe, points).value)).reshape(len(levels), -1)
    return np.asarray(value / np.array(levels)[:, None])
