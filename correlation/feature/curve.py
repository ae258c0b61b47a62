"""Measured curves: fundamental of the largest motion over the frequencies of one sweep of one repeat."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, number_frequencies
from correlation.row_group import group_rows


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveSet:
    """All sweeps of one level of one configuration, read by one sensor.

    Parameters
    ----------
    free, level
        Configuration, and level [-, unit of the drive].
    sensor
        Name of the sensor.
    has_phase
        Whether values are complex; otherwise they are amplitudes.
    frequency
        Frequencies, ascending, shape (n,) [Hz].
    sweep, repeat
        Direction (+1 up, -1 down, 0 none) and number of the repeat of each curve, shape (c,).
    value
        Fundamental, shape (c, n) [SI unit of the sensor]; NaN where it was not read.
    """

    free: bool
    level: float
    sensor: str
    has_phase: bool
    frequency: Float[NDArray[np.float64], " n"]
    sweep: Int[NDArray[np.int64], " c"]
    repeat: Int[NDArray[np.int64], " c"]
    value: Complex[NDArray[np.complex128], "c n"]

    @property
    def parts(self) -> int:
        """Number of parts of each value: two if complex, one for an amplitude [-]."""
        return 2 if self.has_phase else 1


def list_curves(campaign: Campaign) -> list[CurveSet]:
    """Curves of each configuration and level, in this order; levels without a reading of a motion are left out."""
    table, result = campaign.measurement, []
    is_free = campaign.is_free[table.test]
    for free in np.unique(is_free):
        for level in np.unique(table.level[is_free == free]):
            rows = _find_largest_motion(campaign, (is_free == free) & (table.level == level))
            if rows.any():
                result.append(_arrange_curves(campaign, rows, bool(free)))
    return result


def _arrange_curves(campaign: Campaign, rows: Bool[NDArray[np.bool_], " k"], free: bool) -> CurveSet:
    table = campaign.measurement.where(rows)
    number = number_frequencies(table.frequency)
    runs, curve = group_rows([table.sweep, table.repeat])
    shape = (len(runs), int(number.max()) + 1)
    total, count = np.zeros(shape, dtype=np.complex128), np.zeros(shape)
    np.add.at(total, (curve, number), table.value)
    np.add.at(count, (curve, number), 1.0)
    first = np.unique(number, return_index=True)[1]
    sensor = campaign.sensors[int(table.sensor[0])]
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.where(count > 0, total / count, np.nan)
    return CurveSet(
        free=free, level=float(table.level[0]), sensor=sensor.name, has_phase=sensor.has_phase,
        frequency=table.frequency[first], sweep=table.sweep[runs], repeat=table.repeat[runs], value=value,
    )  # fmt: skip


def _find_largest_motion(campaign: Campaign, there: Bool[NDArray[np.bool_], " k"]) -> Bool[NDArray[np.bool_], " k"]:
    """Rows of the fundamental of the sensor with the largest motion; one with a phase if there is any."""
    table = campaign.measurement
    follows = np.array([sensor.line is None for sensor in campaign.sensors])
    rows = there & follows[table.sensor] & (table.harmonic == 1) & (np.abs(table.value) > 0)
    sensors = np.unique(table.sensor[rows])
    if not len(sensors):
        return np.asarray(rows)
    phased = [number for number in sensors if campaign.sensors[number].has_phase]
    chosen = phased or sensors.tolist()
    largest = chosen[int(np.argmax([np.abs(table.value[rows & (table.sensor == item)]).mean() for item in chosen]))]
    return np.asarray(rows & (table.sensor == largest))
