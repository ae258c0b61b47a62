"""Passes of a stepped sine over the frequencies: their start, direction and order, and repeated readings."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import number_frequencies

Real = Float[NDArray[np.float64], " n"]
Whole = Int[NDArray[np.int64], " n"]

#: Smallest factor between two branches, and number of neighbouring frequencies over which they differ by it.
BRANCH_FACTOR, BRANCH_POINTS = 1.25, 3
#: Sweep by its name in files, in lower case.
SWEEP_WORDS = {
    "up": 1, "forward": 1, "rising": 1, "auf": 1, "aufwärts": 1, "down": -1, "backward": -1, "falling": -1, "ab": -1,
    "abwärts": -1, "none": 0,
}  # fmt: skip


def find_passes(frequency: Real) -> tuple[Whole, Whole]:
    """Sweep (+1 up, -1 down, 0 if all rows have one frequency) and pass, from 0, of each row, shape (n,) each.

    A pass ends where the frequency reverses its direction, or jumps back and then continues in the same direction. If
    a test reads the turning point twice, the second reading is the first of the new pass. Frequencies that differ by
    less than `SAME_FREQUENCY` are the same.

    Parameters
    ----------
    frequency
        Frequencies in the order of measurement, shape (n,) [Hz].
    """
    place = number_frequencies(frequency)
    starts = np.flatnonzero(np.diff(place, prepend=place[:1] - 1))
    if len(starts) < 2:
        return np.zeros(len(frequency), dtype=np.int64), np.arange(len(frequency))
    count = np.diff([*starts, len(frequency)])
    rise = np.diff(place[starts])
    step = np.sign(rise)
    # After one step back by more than a point, a new pass in the same direction begins.
    back = np.flatnonzero((step[:-2] == step[2:]) & (step[1:-1] == -step[2:]) & (np.abs(rise[1:-1]) > 1)) + 2
    way = np.concatenate([step[:1], step])
    way[back] = -way[back]
    begins = np.diff(way, prepend=way[:1]) != 0
    begins[back] = True
    number = np.cumsum(begins)
    sweep, of_pass = np.repeat(way, count), np.repeat(number, count)
    usual = int(np.median(count))
    for turn in np.flatnonzero(way[1:] != way[:-1]):
        if count[turn] >= 2 * usual:
            late = slice(starts[turn] + (count[turn] + 1) // 2, starts[turn] + count[turn])
            sweep[late], of_pass[late] = way[turn + 1], number[turn + 1]
    return sweep.astype(np.int64), of_pass


def number_stated_passes(frequency: Real, sweep: Whole) -> Whole:
    """Number of the pass, from 0, of each row from the stated sweeps, shape (n,).

    A pass ends where the sweep changes, or where the frequency moves against the direction of the sweep.
    """
    step = np.diff(number_frequencies(frequency))
    begins = (np.diff(sweep) != 0) | (step * sweep[1:] < 0)
    return np.cumsum(np.concatenate([[0], begins])).astype(np.int64)


def name_branches(sweep: Whole, of_pass: Whole, level: Real, frequency: Real, size: Real) -> Whole:
    """Sweeps after the branches that a table lists one after the other are identified, shape (n,).

    Tables of published curves list all branches by rising frequency. If two passes of a level have the same direction
    and overlap in part, and one lies above the other there by a factor that varies, the pass that begins at the lower
    frequency was swept up, and the other one down. In contrast, two sweeps through a resonance that has shifted cross,
    and two sweeps at different forces differ by a constant factor.

    Parameters
    ----------
    sweep, of_pass
        Sweep and number of the pass of each row from the order of the rows, shape (n,).
    level, frequency
        Shape (n,) [unit of the drive, Hz].
    size
        Amplitude of a motion, shape (n,) [any unit]; NaN where it was not measured.
    """
    named = sweep.copy()
    passes = [np.flatnonzero((of_pass == number) & np.isfinite(size)) for number in np.unique(of_pass)]
    for one, other in pairwise(rows[np.argsort(frequency[rows])] for rows in passes if len(rows) > 1):
        if sweep[one[0]] == sweep[other[0]] and level[one[0]] == level[other[0]]:
            lower, upper = sorted((one, other), key=lambda rows: tuple(frequency[rows[[0, -1]]]))
            shifted = frequency[lower[0]] < frequency[upper[0]] and frequency[lower[-1]] < frequency[upper[-1]]
            if shifted and _are_branches(frequency[lower], size[lower], frequency[upper], size[upper]):
                for rows, way in ((lower, 1), (upper, -1)):
                    named[of_pass == of_pass[rows[0]]] = way
    return named


def reverse_listed_sweeps(order: Whole, of_pass: Whole, frequency: Real, sweep: Whole) -> Whole:
    """Order of measurement, reversed within sweeps that a table lists against their direction, shape (n,)."""
    turned = order.copy()
    for number in np.unique(of_pass):
        rows = np.flatnonzero(of_pass == number)
        if (frequency[rows[-1]] - frequency[rows[0]]) * sweep[rows[0]] < 0:
            turned[rows] = turned[rows[::-1]]
    return turned


class Difference(NamedTuple):
    """First and last frequency of the range in which two curves differ, and the largest factor between them."""

    first: float
    last: float
    factor: float


def find_difference(frequency: Real, size: Real, other: Real, other_size: Real) -> Difference | None:
    """Longest range of neighbouring frequencies in which two curves of rising frequency differ; None if there is none.

    A range has at least `BRANCH_POINTS` frequencies at which the curves differ by more than `BRANCH_FACTOR`.
    """
    if not len(frequency) or not len(other):
        return None
    ratio = np.abs(_compute_log_ratio(frequency, size, other, other_size))
    apart = ratio > np.log(BRANCH_FACTOR)
    runs = np.split(np.arange(len(ratio)), np.flatnonzero(np.diff(apart)) + 1)
    longest = max((rows for rows in runs if apart[rows].any()), key=len, default=np.zeros(0, dtype=np.int64))
    if len(longest) < BRANCH_POINTS:
        return None
    return Difference(float(frequency[longest[0]]), float(frequency[longest[-1]]), float(np.exp(ratio[longest].max())))


def _are_branches(frequency: Real, size: Real, other: Real, other_size: Real) -> bool:
    """Whether one of two curves is above the other wherever they overlap, by a factor that varies."""
    ratio = _compute_log_ratio(frequency, size, other, other_size)
    ratio = ratio[np.isfinite(ratio)]
    if not len(ratio) or (ratio.min() < 0 < ratio.max()) or np.ptp(ratio) < np.log(BRANCH_FACTOR):
        return False
    return find_difference(frequency, size, other, other_size) is not None


def _compute_log_ratio(frequency: Real, size: Real, other: Real, other_size: Real) -> Real:
    """Logarithm of the ratio of two curves at the frequencies of the first; NaN outside the range of the second."""
    beside = np.interp(frequency, other, other_size, left=np.nan, right=np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.log(size / beside))


def count_repeats(frequency: Real, sweep: Whole, level: Real) -> Whole:
    """Number of earlier rows with the same frequency, sweep and level, shape (n,)."""
    seen: dict[tuple[float, ...], int] = {}
    repeat = np.zeros(len(frequency), dtype=np.int64)
    keys: Sequence[tuple[float, ...]] = list(
        zip(number_frequencies(frequency).tolist(), sweep.tolist(), level.tolist(), strict=True)
    )
    for row, key in enumerate(keys):
        repeat[row] = seen.get(key, 0)
        seen[key] = repeat[row] + 1
    return repeat
