"""Features of measurements that a model can say something of, whatever sits where nothing moves."""

import numpy as np

from correlation.feature.observation import Observation
from correlation.prediction import Points
from diagnosis.fit.weighting import Measured

NOISE, N_REPEAT = 1e-9, 4
FREQUENCY = np.arange(1.0, 9.0)


def test_a_silent_sensor_agrees_with_a_model_in_which_it_does_not_move() -> None:
    k, random = len(FREQUENCY), np.random.default_rng(5)
    motion = np.concatenate([1e-6 / FREQUENCY, np.zeros(k)]).astype(np.complex128)
    parts = random.standard_normal((2, 2 * k, N_REPEAT)) * NOISE
    repeat = motion[:, None] + parts[0] + 1j * parts[1]
    points = Points(
        free=np.ones(2 * k, dtype=bool), level=np.ones(2 * k), frequency=np.tile(FREQUENCY, 2),
        sensor=np.repeat(["tip", "hung"], k), harmonic=np.ones(2 * k, dtype=np.int64),
    )  # fmt: skip
    observed = Observation(
        points=points, repeat=repeat, motion=np.ones(2 * k, dtype=bool), taken=np.ones(repeat.shape, dtype=bool)
    )
    features = Measured.prepare(observed, ()).features
    # A model's zero is a zero or its round-off; the inverse of either would be off by 1e15 standard deviations.
    motion[k:] = 1e-24
    apart = features.of_repeats(observed.repeat, observed.taken) - features.of_values(motion)
    sigma = NOISE * features.per_reading(observed.value) / np.sqrt(N_REPEAT)
    silent = features.points.sensor[features.row] == "hung"
    # 2 k numbers of unit variance: their mean square is beyond 2.5 once in 1e4 draws, and the seed is fixed.
    assert np.mean((apart / sigma)[silent] ** 2) < 2.5
