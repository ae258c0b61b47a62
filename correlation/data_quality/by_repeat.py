"""Readings of some sensors side by side, so that one repeat can be held against the others."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.campaign.measurement import Measurement
from correlation.row_group import group_rows

#: Values of s sensors at n points in r repeats.
Repeats = Complex[NDArray[np.complex128], "s n r"]


def arrange_by_repeat(table: Measurement, sensors: Sequence[int], harmonic: int = 1) -> tuple[list[int], Repeats]:
    """Numbers of the repeats, rising, and the values by point and repeat, NaN where one is not measured.

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
    point = group_rows([table.level[rows], table.frequency[rows], table.sweep[rows]]).number
    values = np.full((len(sensors), point.max(initial=-1) + 1, len(repeats)), np.nan, dtype=np.complex128)
    for place, sensor in enumerate(sensors):
        own = table.sensor[rows] == sensor
        values[place, point[own], column.ravel()[rows[own]]] = table.value[rows[own]]
    return repeats.tolist(), values
