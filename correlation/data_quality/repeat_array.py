"""Readings of some sensors as one array over points and repeats, for comparison of one repeat with the others."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import Measurement
from correlation.row_group import group_rows

#: Values of s sensors at n points in r repeats.
Repeats = Complex[NDArray[np.complex128], "s n r"]


class RepeatArray(NamedTuple):
    """Values of one harmonic by point and repeat.

    Parameters
    ----------
    repeat
        Numbers of the repeats, rising.
    value
        Values, NaN where one is not measured, shape (s, n, r).
    level, frequency, sweep
        Level, frequency [Hz] and sweep of each point, shape (n,).
    """

    repeat: list[int]
    value: Repeats
    level: Float[NDArray[np.float64], " n"]
    frequency: Float[NDArray[np.float64], " n"]
    sweep: Int[NDArray[np.int64], " n"]


def arrange_repeats(table: Measurement, sensors: Sequence[int], harmonic: int = 1) -> RepeatArray:
    """Arrange the values of some sensors.

    Parameters
    ----------
    table
        Rows of one test.
    sensors
        Numbers of the sensors, in the order of the result.
    harmonic
        Harmonic of the values [-].
    """
    repeats, column = np.unique(table.repeat, return_inverse=True)
    rows = np.flatnonzero((table.harmonic == harmonic) & np.isin(table.sensor, sensors))
    point = group_rows([table.level[rows], table.frequency[rows], table.sweep[rows]])
    values = np.full((len(sensors), len(point.first), len(repeats)), np.nan, dtype=np.complex128)
    for place, sensor in enumerate(sensors):
        own = table.sensor[rows] == sensor
        values[place, point.number[own], column.ravel()[rows[own]]] = table.value[rows[own]]
    first = rows[point.first]
    return RepeatArray(repeats.tolist(), values, table.level[first], table.frequency[first], table.sweep[first])
