"""Readings side by side: each stands at its point and repeat, and what was not measured is NaN."""

import numpy as np

from correlation.campaign.measurement import Measurement
from correlation.data_quality.repeat_array import arrange_repeats


def test_a_reading_stands_at_its_sensor_point_and_repeat() -> None:
    # Sensor 1 lacks 11 Hz in repeat 3; sensor 0, harmonic 2 is another quantity.
    rows = [(0, 10, 1, 1), (1, 10, 1, 2), (0, 11, 1, 3), (1, 11, 1, 4), (0, 10, 3, 5), (1, 10, 3, 6), (0, 11, 3, 7)]
    sensor, frequency, repeat, value = np.array([*rows, (0, 10, 1, 9)]).T
    one = np.ones(len(sensor), dtype=np.int64)
    table = Measurement(
        test=0 * one, order=one, repeat=repeat, sweep=one, level=one.astype(float), frequency=frequency.astype(float),
        sensor=sensor, harmonic=np.array([1] * len(rows) + [2]), value=value.astype(complex), force=one.astype(float),
    )  # fmt: skip
    arranged = arrange_repeats(table, [1, 0])
    assert arranged.repeat == [1, 3]
    assert arranged.frequency.tolist() == [10, 11]
    np.testing.assert_array_equal(arranged.value, [[[2, 6], [4, np.nan]], [[1, 5], [3, 7]]])
