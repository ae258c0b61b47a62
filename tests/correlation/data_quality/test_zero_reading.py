"""A single reading of exactly zero is a point that was not measured."""

from dataclasses import replace

import numpy as np

from correlation.data_quality.zero_reading import find_zero_readings
from tests.correlation.data_quality.test_unit_suspicion import campaign


def test_one_zero_is_named_with_its_place_and_a_silent_channel_is_left_to_another_check() -> None:
    right = campaign()
    assert not list(find_zero_readings(right))
    table = right.measurement
    own = np.flatnonzero((table.sensor == 0) & (table.harmonic == 1))
    for rows, count in ((own[3:4], 1), (own, 0)):
        value = table.value.copy()
        value[rows] = 0
        result = list(find_zero_readings(replace(right, measurement=replace(table, value=value))))
        assert len(result) == count
        if result:
            assert f"{table.frequency[own[3]]:g} Hz" in result[0].sentence
            assert right.sensors[0].name in result[0].where
