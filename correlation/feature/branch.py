r"""Branches: points at which upward and downward sweep, or two repeats, measured different steady states.

If a structure has two steady states, the sweep direction selects one of them, and the mean of both is not a steady
state. A point has two branches if the sweeps of the same repeat differ

- by more than the noise of the curves (`correlation.noise.smoothness`),
- by more than a shift of all frequencies between the sweeps explains, and
- so much that the error of their mean is significant: the mean of :math:`F / X` over two values with the relative
  difference :math:`\varepsilon` has the relative error :math:`\varepsilon^2 / 4`.

Repeats of one sweep differ if some of them jumped earlier. Readings on the branch of the minority are excluded; without
a majority none of them can be used.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import SAME_FREQUENCY, Campaign
from correlation.campaign.passes import find_difference
from correlation.feature.curve import CurveSet, list_curves
from correlation.feature.jump import find_curve_jumps
from correlation.noise.smoothness import estimate_curve_noise

Curves = Complex[NDArray[np.complex128], "r n"]

#: Least difference of the sweeps, in standard deviations of noise, and relative [-].
CLEAR_DIFFERENCE, MIN_DIFFERENCE = 5.0, 0.05
#: A frequency shift explains the difference of two sweeps if it leaves at most this share of its median [-].
MAX_SHARE_LEFT = 0.6
#: Least gap between two groups of repeats over the spread of either group [-], and lower limit of the spread in
#: standard deviations of noise.
GAP, NOISY = 3.0, 2.0
#: Ratio of the scatter at a point to the median of neighbouring points above which it is not noise, number of these
#: points, and least number of readings.
SCATTER, BESIDE, FEWEST = 3.0, 6, 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Branches:
    """Branches to which the readings of a set of curves belong.

    Parameters
    ----------
    curves
        The curves.
    noise
        Standard deviation of each reading by noise, shape (c, n); NaN if curves are too short to estimate it.
    bistable
        States at which the sweeps measured different branches, shape (n,).
    in_one_sweep
        States that were read in one sweep alone, at a level with different branches, shape (n,).
    excluded
        Readings excluded from the average of their sweep, shape (c, n): on another branch than most repeats, or of a
        state without a majority.
    """

    curves: CurveSet
    noise: Float[NDArray[np.float64], "c n"]
    bistable: Bool[NDArray[np.bool_], " n"]
    in_one_sweep: Bool[NDArray[np.bool_], " n"]
    excluded: Bool[NDArray[np.bool_], "c n"]

    @property
    def is_empty(self) -> Bool[NDArray[np.bool_], " n"]:
        """Mask of states of which all readings are excluded, shape (n,)."""
        there = np.isfinite(self.curves.value)
        return np.asarray((there & self.excluded).any(axis=0) & ~(there & ~self.excluded).any(axis=0))


@lru_cache(maxsize=2)  # several parts of one comparison ask
def find_branches(campaign: Campaign) -> tuple[Branches, ...]:
    """Branches of each configuration and level."""
    return tuple(separate_branches(curves) for curves in list_curves(campaign))


def separate_branches(curves: CurveSet) -> Branches:
    """Separate the branches of one level."""
    noise = np.array([_estimate_noise(curves, number) for number in range(len(curves.value))])
    excluded = np.zeros(curves.value.shape, dtype=bool)
    ways = [np.flatnonzero(curves.sweep == way) for way in np.unique(curves.sweep)]
    for rows in ways:
        for state in _find_states_between_jumps(curves.frequency, curves.value[rows], noise[rows]):
            excluded[rows, state] = find_minority(curves.value[rows, state], noise[rows, state])
    bistable = _find_bistable(curves, np.where(excluded, np.nan, curves.value), noise)
    for state in np.flatnonzero(find_scattered(curves, bistable) & ~excluded.any(axis=0)).tolist():
        for rows in ways if bistable[state] else [np.arange(len(excluded))]:
            excluded[rows, state] = find_minority(curves.value[rows, state], noise[rows, state], scattered=True)
    return Branches(
        curves=curves,
        noise=noise,
        bistable=bistable,
        in_one_sweep=_find_in_one_sweep(curves, bistable),
        excluded=excluded,
    )


def classify_readings(
    campaign: Campaign, branches: Sequence[Branches]
) -> tuple[Bool[NDArray[np.bool_], " k"], Bool[NDArray[np.bool_], " k"]]:
    """Rows of a campaign that are bistable or of one sweep alone, and rows to exclude from averages, shape (k,)."""
    table = campaign.measurement
    free = campaign.is_free[table.test]
    bistable, excluded = np.zeros(len(table), dtype=bool), np.zeros(len(table), dtype=bool)
    for item in branches:
        if not (item.bistable.any() or item.in_one_sweep.any() or item.excluded.any()):
            continue
        of = item.curves
        rows = np.flatnonzero((free == of.free) & (table.level == of.level))
        state = find_states(of.frequency, table.frequency[rows])
        rows, state = rows[state >= 0], state[state >= 0]
        bistable[rows] = (item.bistable | item.in_one_sweep)[state]
        number = {key: curve for curve, key in enumerate(zip(of.sweep.tolist(), of.repeat.tolist(), strict=True))}
        keys = zip(table.sweep[rows].tolist(), table.repeat[rows].tolist(), strict=True)
        curve = np.array([number.get(key, -1) for key in keys], dtype=np.int64)
        # A sensor may have been read in a sweep in which the sensor of the curves was not.
        excluded[rows] = np.where(curve >= 0, item.excluded[curve, state], item.is_empty[state])
    return bistable, excluded


def find_states(
    known: Float[NDArray[np.float64], " n"], frequency: Float[NDArray[np.float64], " k"]
) -> Int[NDArray[np.int64], " k"]:
    """Index of each frequency among known, ascending ones, shape (k,); -1 without a match."""
    middle = (known[1:] + known[:-1]) / 2
    nearest = np.searchsorted(middle, frequency)
    return np.where(np.abs(frequency / known[nearest] - 1) < 2 * SAME_FREQUENCY, nearest, -1)


def find_minority(
    value: Complex[NDArray[np.complex128], " r"], noise: Float[NDArray[np.float64], " r"], *, scattered: bool = False
) -> Bool[NDArray[np.bool_], " r"]:
    """Mask of readings of one state on another branch than the majority, shape (r,); all of them without a majority.

    Parameters
    ----------
    value, noise
        Readings and their standard deviations, shape (r,).
    scattered
        Whether the readings are known to scatter, so that they cannot be used if they do not form two groups.
    """
    there = np.flatnonzero(np.isfinite(value))
    result = np.zeros(len(value), dtype=bool)
    if len(there) < 2:
        return result
    order = there[np.argsort(np.abs(value[there]))]
    size = np.abs(value[order])
    gap = np.diff(size)
    cut = int(np.argmax(gap)) + 1
    by_noise = NOISY * float(np.nan_to_num(noise[order]).max())
    spread = max(float(np.ptp(size[:cut])), float(np.ptp(size[cut:])), by_noise)
    apart = gap[cut - 1] > max(GAP * spread, MIN_DIFFERENCE * size[-1])
    if not apart:
        result[there] = scattered
    elif 2 * cut == len(order):
        result[there] = True
    else:
        result[order[:cut] if 2 * cut < len(order) else order[cut:]] = True
    return result


def _estimate_noise(curves: CurveSet, number: int) -> Float[NDArray[np.float64], " n"]:
    value, noise = curves.value[number], np.full(len(curves.frequency), np.nan)
    there = np.isfinite(value)
    noise[there], _ = estimate_curve_noise(curves.frequency[there], value[there], parts=curves.parts)
    return noise


def _find_states_between_jumps(
    frequency: Float[NDArray[np.float64], " n"], value: Curves, noise: Float[NDArray[np.float64], "r n"]
) -> Iterator[int]:
    """States that are before a jump in some repeats and after it in others."""
    if len(value) < 2:
        return
    jumps = [find_curve_jumps(frequency, curve, scatter) for curve, scatter in zip(value, noise, strict=True)]
    places = np.unique(np.concatenate(jumps))
    if not len(places):
        return
    # Jumps within a few points are the same jump.
    for group in np.split(places, np.flatnonzero(np.diff(places) > max(3, value.shape[1] // 10)) + 1):
        # A repeat whose jump was not recognised may have jumped one step aside.
        yield from range(max(int(group[0]), 0), min(int(group[-1]) + 2, value.shape[1]))


def _find_bistable(
    curves: CurveSet, value: Complex[NDArray[np.complex128], "c n"], noise: Float[NDArray[np.float64], "c n"]
) -> Bool[NDArray[np.bool_], " n"]:
    """States at which the sweeps measured different branches, shape (n,)."""
    repeats = np.intersect1d(curves.repeat[curves.sweep == 1], curves.repeat[curves.sweep == -1])
    if not len(repeats):
        return np.zeros(value.shape[1], dtype=bool)
    up, down = ([_find_row(curves, way, repeat) for repeat in repeats] for way in (1, -1))
    own = np.hypot(noise[up], noise[down])
    pairs = zip(value[up], value[down], own, strict=True)
    apart = np.array([_without_shift(curves.frequency, *pair) for pair in pairs])
    known = np.isfinite(apart)
    count = np.maximum(known.sum(axis=0), 1)
    mean = np.where(known, apart, 0.0).sum(axis=0) / count
    variance = np.where(known, own**2, 0.0).sum(axis=0) / count**2
    if not np.isfinite(variance).all():
        # Too few frequencies to estimate the noise of a curve: use the scatter of the difference over the repeats.
        squares = np.where(known, np.abs(apart - mean) ** 2, 0.0).sum(axis=0) / np.maximum(count - 1, 1) / curves.parts
        usual = float(np.median(squares[count > 1])) if (count > 1).any() else np.inf
        variance = np.maximum(squares, usual) / count
    size = np.fmax(*(np.abs(np.where(np.isfinite(value[rows]), value[rows], 0)).max(axis=0) for rows in (up, down)))
    clear = np.abs(mean) > CLEAR_DIFFERENCE * np.sqrt(curves.parts * variance)
    return np.asarray(known.any(axis=0) & clear & (np.abs(mean) > MIN_DIFFERENCE * size))


def _find_in_one_sweep(curves: CurveSet, bistable: Bool[NDArray[np.bool_], " n"]) -> Bool[NDArray[np.bool_], " n"]:
    """States that were read in one sweep alone, if the sweeps measured different branches anywhere, shape (n,)."""
    ways = [curves.sweep == way for way in (1, -1)]
    up, down = (np.isfinite(curves.value[rows]).any(axis=0) for rows in ways)
    if not (up.any() and down.any()):
        return np.zeros(len(bistable), dtype=bool)
    first, back = (np.abs(_average_readings(curves.value[rows])[0]) for rows in ways)
    frequency = curves.frequency
    apart = bistable.any() or find_difference(frequency[up], first[up], frequency[down], back[down]) is not None
    return np.asarray((up != down) & apart)


def _find_row(curves: CurveSet, way: int, repeat: int) -> int:
    return int(np.flatnonzero((curves.sweep == way) & (curves.repeat == repeat))[0])


def _without_shift(
    frequency: Float[NDArray[np.float64], " n"],
    up: Complex[NDArray[np.complex128], " n"],
    down: Complex[NDArray[np.complex128], " n"],
    noise: Float[NDArray[np.float64], " n"],
) -> Complex[NDArray[np.complex128], " n"]:
    """Difference of two sweeps, less the effect of a common frequency shift if this explains most of it."""
    apart = up - down
    there = np.flatnonzero(np.isfinite(apart))
    if len(there) < FEWEST:
        return apart
    rate = np.gradient((up[there] + down[there]) / 2, np.log(frequency[there]))
    scale = noise[there] if np.isfinite(noise[there]).all() else np.ones(len(there))
    size = np.maximum(np.abs(rate) ** 2, np.finfo(float).tiny)
    # Weighted median of the shifts of single states, which is insensitive to a branch.
    shifts, weight = (np.conj(rate) * apart[there]).real / size, np.abs(rate) / scale
    order = np.argsort(shifts)
    shift = shifts[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)]
    left = apart[there] - shift * rate
    if np.median(np.abs(left) / scale) > MAX_SHARE_LEFT * np.median(np.abs(apart[there]) / scale):
        return apart
    explained = np.array(apart)
    explained[there] = np.where(np.abs(left) < np.abs(apart[there]), left, apart[there])
    return explained


def find_scattered(curves: CurveSet, bistable: Bool[NDArray[np.bool_], " n"]) -> Bool[NDArray[np.bool_], " n"]:
    """States whose readings scatter far more than their neighbours, both as X and as 1 / X, shape (n,).

    With jitter the scatter of the dynamic stiffness F / X is nearly equal at neighbouring frequencies, with noise that
    of X. (Away from a resonance F / X alone scatters more, and at a resonance X alone.)
    """
    result = np.ones(len(bistable), dtype=bool)
    with np.errstate(invalid="ignore", divide="ignore"):
        inverse = 1 / curves.value
    for value in (curves.value, inverse):
        there = np.isfinite(value)
        mean = _average_readings(value)
        for way in np.unique(curves.sweep):
            rows = curves.sweep == way
            mean[rows] = np.where(bistable, _average_readings(value[rows]), mean[rows])
        n_mean = np.where(bistable, len(np.unique(curves.sweep)), 1)
        n = there.sum(axis=0)
        squares = np.where(there, np.abs(value - mean) ** 2, 0.0).sum(axis=0)
        result &= _find_outlying(np.where(n >= FEWEST, np.sqrt(squares / np.maximum(n - n_mean, 1)), np.nan))
    return result


def _average_readings(value: Curves) -> Curves:
    """Mean of the readings of each state, in the shape of the readings."""
    there = np.isfinite(value)
    mean = np.where(there, value, 0.0).sum(axis=0) / np.maximum(there.sum(axis=0), 1)
    return np.array(np.broadcast_to(mean, value.shape))


def _find_outlying(scatter: Float[NDArray[np.float64], " n"]) -> Bool[NDArray[np.bool_], " n"]:
    result = np.zeros(len(scatter), dtype=bool)
    known = np.flatnonzero(np.isfinite(scatter))
    if len(known) <= FEWEST:
        return result
    for place, number in enumerate(known):
        first = int(np.clip(place - BESIDE // 2, 0, max(len(known) - BESIDE - 1, 0)))
        beside = [other for other in known[first : first + BESIDE + 1] if other != number]
        result[number] = scatter[number] > SCATTER * np.median(scatter[beside])
    return result
