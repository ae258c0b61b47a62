"""States at which a response jumps: repeats and sweeps disagree there by far more than beside it.

Near a fold the structure has two steady states; repeats take one or the other, and their mean is none. The dynamic
stiffness F / X scatters almost alike at neighbouring frequencies, whatever the noise and the jitter, unless there is a
jump.
"""

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.measurement import Campaign
from correlation.prediction import Points

#: Scatter, as a multiple of the median of so many neighbours, that is a jump.
JUMP, NEIGHBOURS = 3.0, 6
#: Readings that tell a scatter, and states that tell what is usual.
FEWEST = 4


def jumping(campaign: Campaign, points: Points) -> Bool[NDArray[np.bool_], " k"]:
    """Rows of states at which the response jumps, shape (k,).

    Parameters
    ----------
    campaign
        With its single readings.
    points
        Rows of the same campaign.
    """
    found = np.zeros(len(points), dtype=bool)
    for free in np.unique(points.free):
        for level in np.unique(points.level[points.free == free]):
            frequency, scatter = _scatter(campaign, bool(free), float(level))
            for each in frequency[_outlying(scatter)]:
                here = (points.free == free) & (points.level == level)
                found |= here & (np.abs(points.frequency / each - 1) < 1e-5)
    return found


def _scatter(
    campaign: Campaign, free: bool, level: float
) -> tuple[Float[NDArray[np.float64], " n"], Float[NDArray[np.float64], " n"]]:
    """Standard deviation of F / X of the sensor that moves most, at each frequency."""
    table = campaign.measurement
    tests = np.array([(test.configuration == "free") == free for test in campaign.tests])
    motion = np.array([sensor.line is None for sensor in campaign.sensors])
    rows = tests[table.test] & (table.level == level) & motion[table.sensor] & (table.harmonic == 1)
    rows &= np.abs(table.value) > 0
    if not rows.any():
        return np.zeros(0), np.zeros(0)
    sensors = np.unique(table.sensor[rows])
    largest = sensors[np.argmax([np.abs(table.value[rows & (table.sensor == each)]).mean() for each in sensors])]
    rows &= table.sensor == largest
    stiffness = table.level[rows] / table.value[rows]
    frequency, state = np.unique(table.frequency[rows], return_inverse=True)
    n = np.bincount(state)
    mean = (np.bincount(state, stiffness.real) + 1j * np.bincount(state, stiffness.imag)) / n
    variance = np.bincount(state, np.abs(stiffness - mean[state]) ** 2) / np.maximum(n - 1, 1)
    return frequency, np.where(n >= FEWEST, np.sqrt(variance), np.nan)


def _outlying(scatter: Float[NDArray[np.float64], " n"]) -> Bool[NDArray[np.bool_], " n"]:
    found = np.zeros(len(scatter), dtype=bool)
    known = np.flatnonzero(np.isfinite(scatter))
    if len(known) <= FEWEST:
        return found
    for place, number in enumerate(known):
        first = int(np.clip(place - NEIGHBOURS // 2, 0, max(len(known) - NEIGHBOURS - 1, 0)))
        beside = [each for each in known[first : first + NEIGHBOURS + 1] if each != number]
        found[number] = scatter[number] > JUMP * np.median(scatter[beside])
    return found
