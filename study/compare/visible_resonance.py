"""Resonances of a model that a test can show."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model, Sensor
from fe.dense_modes import compute_dense_modes
from reduction.stuck import stick_at_rest

#: Height of a resonance relative to the highest one, below which no test shows it [-].
FAINT = 0.01


def find_visible_resonances(model: Model) -> Float[NDArray[np.float64], " m"]:
    """Ascending frequencies of the resonances, contacts stuck, that the force drives and a sensor sees [Hz]."""
    system = model.system
    modes = compute_dense_modes(system.mass, stick_at_rest(system.stiffness, system.joints))
    elastic = modes.frequency > 0
    frequency, shapes = modes.frequency[elastic], modes.mode_shapes[:, elastic]
    driven = np.linalg.norm(system.dynamic @ shapes, axis=0)
    rows = np.array([sensor.row for sensor in model.sensors if isinstance(sensor, Sensor)])
    seen = np.linalg.norm(rows @ shapes, axis=0) if len(rows) else 1.0
    height = driven * seen / frequency**2
    return np.asarray(frequency[height >= FAINT * height.max(initial=0.0)])
