"""States at which a response jumps: repeats and sweeps disagree there by far more than beside it.

Near a fold the structure has two steady states; repeats take one or the other, and their mean is none. Jitter makes the
dynamic stiffness F / X scatter almost alike at neighbouring frequencies, and noise X itself; where both stand out there
is a jump. (Away from a resonance F / X alone scatters more, and at a resonance X alone.)
"""

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import SAME_FREQUENCY, Campaign, Suspicion
from correlation.prediction import Points

Scatter = Float[NDArray[np.float64], " n"]

#: Scatter, as a multiple of the median of so many neighbours, that is a jump.
JUMP, NEIGHBOURS = 3.0, 6
#: Readings that tell a scatter, and states that tell what is usual.
FEWEST = 4


def find_jumps(campaign: Campaign, points: Points) -> Bool[NDArray[np.bool_], " k"]:
    """Rows of states at which the response jumps, shape (k,).

    Parameters
    ----------
    campaign
        Campaign with its single readings.
    points
        Rows of the same campaign.
    """
    found = np.zeros(len(points), dtype=bool)
    for free, level, frequency in _jumps(campaign):
        near = np.abs(points.frequency / frequency - 1) < SAME_FREQUENCY
        found |= (points.free == free) & (points.level == level) & near
    return found


def find_jump_suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """One for each state at which the response jumps."""
    return tuple(
        Suspicion(
            where=f"{'free' if free else 'jointed'} test, {level:g} N, {frequency:g} Hz",
            sentence=(
                f"repeats and sweeps scatter more than {JUMP:g} times as much as at the frequencies beside it: the "
                "response jumps between two steady states; the point is left out of every fit"
            ),
        )
        for free, level, frequency in _jumps(campaign)
    )


def _jumps(campaign: Campaign) -> list[tuple[bool, float, float]]:
    """Configuration, level [N] and frequency [Hz] of each."""
    table, found = campaign.measurement, []
    is_free = np.array([test.configuration == "free" for test in campaign.tests])[table.test]
    for free in np.unique(is_free):
        for level in np.unique(table.level[is_free == free]):
            rows = _fundamental(campaign, bool(free), float(level))
            frequency, stiffness, motion = _scatter(campaign, rows)
            there = frequency[(_outlying(stiffness) & _outlying(motion)) | _outlying(_hysteresis(campaign, rows))]
            found += [(bool(free), float(level), float(each)) for each in there]
    return found


def _fundamental(campaign: Campaign, free: bool, level: float) -> Bool[NDArray[np.bool_], " r"]:
    """Rows of the fundamental of the sensor that moves most."""
    table = campaign.measurement
    tests = np.array([(test.configuration == "free") == free for test in campaign.tests])
    follows = np.array([sensor.line is None for sensor in campaign.sensors])
    rows = tests[table.test] & (table.level == level) & follows[table.sensor] & (table.harmonic == 1)
    rows &= np.abs(table.value) > 0
    sensors = np.unique(table.sensor[rows])
    if not len(sensors):
        return np.asarray(rows)
    largest = sensors[np.argmax([np.abs(table.value[rows & (table.sensor == each)]).mean() for each in sensors])]
    return np.asarray(rows & (table.sensor == largest))


def _scatter(campaign: Campaign, rows: Bool[NDArray[np.bool_], " r"]) -> tuple[Scatter, Scatter, Scatter]:
    """Frequencies, and the standard deviations of F / X and X there."""
    table = campaign.measurement
    frequency, state = np.unique(table.frequency[rows], return_inverse=True)
    motion = table.value[rows]
    if not len(motion):
        return np.zeros(0), np.zeros(0), np.zeros(0)
    return frequency, _deviation(table.level[rows] / motion, state), _deviation(motion, state)


def _hysteresis(campaign: Campaign, rows: Bool[NDArray[np.bool_], " r"]) -> Scatter:
    """Root mean square difference of X between sweeps up and down of the same repeat, relative; NaN where not both."""
    table = campaign.measurement
    frequency, state = np.unique(table.frequency[rows], return_inverse=True)
    repeats, repeat = np.unique(table.repeat[rows], return_inverse=True)
    shape, found = (len(frequency), len(repeats)), []
    for way in (1, -1):
        there = table.sweep[rows] == way
        cell = (state * len(repeats) + repeat)[there]
        motion = table.value[rows][there]
        count = np.bincount(cell, minlength=shape[0] * shape[1])
        total = np.bincount(cell, motion.real, count.size) + 1j * np.bincount(cell, motion.imag, count.size)
        found.append(np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(shape))
    up, down = found
    apart = np.abs(up - down) ** 2 / np.abs((up + down) / 2) ** 2
    known = np.isfinite(apart)
    n = known.sum(axis=1)
    return np.where(n > 1, np.sqrt(np.where(known, apart, 0.0).sum(axis=1) / np.maximum(n, 1)), np.nan)


def _deviation(values: Complex[NDArray[np.complex128], " r"], state: Int[NDArray[np.int64], " r"]) -> Scatter:
    """Of the readings of each state; NaN where they are few."""
    n = np.bincount(state)
    mean = (np.bincount(state, values.real) + 1j * np.bincount(state, values.imag)) / n
    variance = np.bincount(state, np.abs(values - mean[state]) ** 2) / np.maximum(n - 1, 1)
    return np.where(n >= FEWEST, np.sqrt(variance), np.nan)


def _outlying(scatter: Scatter) -> Bool[NDArray[np.bool_], " n"]:
    found = np.zeros(len(scatter), dtype=bool)
    known = np.flatnonzero(np.isfinite(scatter))
    if len(known) <= FEWEST:
        return found
    for place, number in enumerate(known):
        first = int(np.clip(place - NEIGHBOURS // 2, 0, max(len(known) - NEIGHBOURS - 1, 0)))
        beside = [each for each in known[first : first + NEIGHBOURS + 1] if each != number]
        found[number] = scatter[number] > JUMP * np.median(scatter[beside])
    return found
