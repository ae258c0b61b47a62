r"""Two sensors that are swapped in a repeat, or in some of its runs, found by comparison of repeats.

The ratio of two channels is that of a shape: variations of gain, preload and resonance between repeats affect both.
With :math:`q = \ln (x_i / x_j)`, swapped channels have :math:`-q`, so that the distance of a run from the other repeats
is :math:`2 |q|`, and zero if it is swapped back.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import NDArray
from scipy.special import stdtrit

from correlation.campaign.measurement import SWEEPS, Campaign, MeasuredSensor, Suspicion
from correlation.data_quality.logarithm import wrap_phases
from correlation.data_quality.repeat_array import RepeatArray, arrange_repeats

#: A swap is detectable at a point if it changes q by more than the first value [-], and by more than the scatter of the
#: runs does with the second value as probability over all parts, repeats and pairs of a test (Student, Bonferroni) [-].
MIN_CHANGE, BY_CHANCE = 0.04, 0.01
#: Least number of these points, and least fraction of them (more than one of two runs has) at which the channels agree
#: with the other repeats within the fraction `NEAR` of the change if swapped, but not within `FAR` as measured [-].
FEWEST, MOST, NEAR, FAR = 5, 0.6, 1 / 4, 3 / 4
#: Of two repeats, one is wrong if its distance from the other levels exceeds this multiple of that of the other [-].
CLEARER = 2.0

#: ln (x_i / x_j) at n points in r repeats [-].
Logarithms = Complex[NDArray[np.complex128], "n r"]
Mask = Bool[NDArray[np.bool_], " n"]


class _RepeatDeviation(NamedTuple):
    """Distance of each repeat from the others as measured and with swapped channels, change by the swap, and scatter.

    The scatter is that of the others about their median (root mean square, NaN for one). All are logarithms of ratios,
    shape (n, r).
    """

    own: Float[NDArray[np.float64], "n r"]
    swapped: Float[NDArray[np.float64], "n r"]
    change: Float[NDArray[np.float64], "n r"]
    scatter: Float[NDArray[np.float64], "n r"]


class _Swap(NamedTuple):
    """Distance of a part of a repeat from the others, as measured and with swapped channels, over that change.

    Both are medians [-]. The column is that of the repeat, -1 if it may be either of two; the part is in words.
    """

    own: float
    swapped: float
    column: int
    where: str


def find_sensors_swapped_in_a_repeat(campaign: Campaign) -> Iterator[Suspicion]:
    """Pairs of sensors that agree with their other repeats only if they are swapped in one, or in some runs of one.

    Parameters
    ----------
    campaign
        Campaign with at least two repeats.
    """
    motions = campaign.structure_sensors
    for number, test in enumerate(campaign.tests):
        arranged = arrange_repeats(campaign.measurement.where(campaign.measurement.test == number), motions)
        if len(arranged.repeat) < 2:
            continue
        sensors = [campaign.sensors[item] for item in motions]
        pairs = [(i, j) for i, j in combinations(range(len(sensors)), 2) if sensors[i].quantity == sensors[j].quantity]
        for i, j in pairs:
            pair = sensors[i], sensors[j]
            q = _compute_logarithm(arranged, (i, j), pair)
            for swap in _find_swaps(arranged, q, campaign.drive.unit, BY_CHANCE / len(pairs)):
                yield _suspect(test.name, pair, arranged.repeat, swap)


def _suspect(test: str, pair: tuple[MeasuredSensor, MeasuredSensor], repeats: list[int], swap: _Swap) -> Suspicion:
    one_of = swap.column < 0
    asked = "in one of these repeats" if one_of else "in these runs of it" if swap.where else "in this repeat"
    which = f"repeats {repeats[0]} and {repeats[1]}" if one_of else f"repeat {repeats[swap.column]}"
    return Suspicion(
        where=f'test "{test}", {which}{swap.where}',
        sentence=f'the ratio of "{pair[0].name}" and "{pair[1].name}" differs from the other repeats by {swap.own:.0%} '
        f"of what a swap changes it by, and by {swap.swapped:.0%} if they are swapped (medians): were their cables or "
        f"columns swapped {asked}?",
    )


def _compute_logarithm(
    arranged: RepeatArray, pair: tuple[int, int], sensors: tuple[MeasuredSensor, MeasuredSensor]
) -> Logarithms:
    first, second = arranged.value[list(pair)]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = first / second
        q = np.log(ratio if all(sensor.has_phase for sensor in sensors) else np.abs(ratio).astype(np.complex128))
    return np.asarray(np.where(np.isfinite(q), q, np.nan))


def _find_swaps(arranged: RepeatArray, q: Logarithms, level_unit: str, chance: float) -> list[_Swap]:
    """Swaps of one pair: of a whole repeat, otherwise of all its runs at one level, otherwise of single runs."""
    deviation = _compare_with_others(q)
    with np.errstate(invalid="ignore"):
        turns = (deviation.change > MIN_CHANGE) & (deviation.swapped < NEAR * deviation.change)
    if turns.sum(axis=0).max() < FEWEST:
        return []
    every = np.ones(len(q), dtype=np.bool_)
    levels = [(f", level {level:.4g} {level_unit}", arranged.level == level) for level in np.unique(arranged.level)]
    sweeps = np.unique(arranged.sweep)
    runs = [
        (f"{words}, sweep {SWEEPS[int(sweep)]}", mask & (arranged.sweep == sweep))
        for words, mask in levels for sweep in (sweeps if len(sweeps) > 1 else ())
    ]  # fmt: skip
    stages = [("", every)], levels if len(levels) > 1 else [], runs
    chance_of_one = chance / (deviation.own.shape[1] * sum(map(len, stages)))
    for parts in stages:
        swaps = [_find_clearest_swap(arranged, q, deviation, mask, words, chance_of_one) for words, mask in parts]
        result = [swap for swap in swaps if swap is not None]
        # A whole repeat is not swapped if one of its levels agrees with the others as measured.
        if parts is stages[0] and any(_agrees(deviation, mask, swap.column) for swap in result for _, mask in levels):
            continue
        if result:
            return result
    return []


def _compare_with_others(q: Logarithms) -> _RepeatDeviation:
    """Comparison of each repeat with the median of the others; of two repeats, the first represents both."""
    columns = range(q.shape[1] if q.shape[1] > 2 else 1)
    result = _RepeatDeviation(*np.full((4, len(q), len(columns)), np.nan))
    for column in columns:
        rest = np.delete(q, column, axis=1)
        there = np.isfinite(q[:, column]) & np.isfinite(rest).any(axis=1)
        own, rest = q[there, column], rest[there]
        usual = _compute_median(rest)
        result.own[there, column] = np.abs(wrap_phases(own - usual))
        result.swapped[there, column] = np.abs(wrap_phases(own + usual))
        result.change[there, column] = np.abs(wrap_phases(2 * usual))
        if len(columns) > 1:
            apart = np.abs(wrap_phases(rest - usual[:, None])) ** 2
            count = np.isfinite(apart).sum(axis=1) - 1  # the median uses one degree of freedom
            with np.errstate(divide="ignore", invalid="ignore"):
                result.scatter[there, column] = np.sqrt(np.nansum(apart, axis=1) / count)
    return result


def _agrees(deviation: _RepeatDeviation, part: Mask, column: int) -> bool:
    """Whether a part of a repeat, -1 for one of two, agrees with the others as measured."""
    # Of two repeats the first represents both.
    own, swapped, change, _ = (values[part, column if values.shape[1] > 1 else 0] for values in deviation)
    there = np.isfinite(own) & (change > MIN_CHANGE)
    return bool(there.sum() >= FEWEST and np.median(own[there]) < np.median(swapped[there]))


def _find_clearest_swap(
    arranged: RepeatArray, q: Logarithms, deviation: _RepeatDeviation, part: Mask, words: str, chance: float
) -> _Swap | None:
    """The clearest repeat whose channels are swapped in a part of the points; None if there is none."""
    result = []
    count = q.shape[1]
    for column in range(deviation.own.shape[1]):
        own, swapped, change, scatter = (values[:, column] for values in deviation)
        if count > 2:
            usual = _compute_scatter_quantile(arranged.level, scatter, 2 * (count - 2), chance)
        else:  # the reference is the scatter in all other runs of both repeats
            usual = _compute_scatter_quantile(arranged.level[~part], own[~part], 2, chance)
        with np.errstate(invalid="ignore"):
            tells = part & (change > max(MIN_CHANGE, usual))
        if tells.sum() < FEWEST:
            continue
        as_is, swapped = (item[tells] / change[tells] for item in (own, swapped))
        if np.quantile(as_is, 1 - MOST) > FAR and np.quantile(swapped, MOST) < NEAR:
            which = column if count > 2 else _find_odd_repeat(arranged, q, part)
            result.append(_Swap(float(np.median(as_is)), float(np.median(swapped)), which, words))
    return min(result, key=lambda swap: swap.swapped, default=None)


def _compute_scatter_quantile(
    level: Float[NDArray[np.float64], " n"], scatter: Float[NDArray[np.float64], " n"], freedom: int, chance: float
) -> float:
    """Deviation of q that scatter exceeds with a probability of `chance`.

    The scatter is the root mean square of its medians at each level, which have `freedom` degrees of freedom each.
    """
    known = np.isfinite(scatter)
    medians = [float(np.median(scatter[known & (level == one)])) for one in np.unique(level[known])]
    if not medians:
        return 0.0
    return float(stdtrit(freedom * len(medians), 1 - chance / 2) * np.sqrt(np.mean(np.square(medians))))


def _find_odd_repeat(arranged: RepeatArray, q: Logarithms, part: Mask) -> int:
    """Column of the one of two repeats that is further from other levels at equal frequencies; -1 if undecided."""
    rest = q[~part]
    distances = []
    for frequency, own in zip(arranged.frequency[part], q[part], strict=True):
        same = rest[arranged.frequency[~part] == frequency].ravel()
        if np.isfinite(same).any() and np.isfinite(own).all():
            distances.append(np.abs(wrap_phases(own - _compute_median(same[None])[0])))
    if len(distances) < FEWEST:
        return -1
    first, second = np.median(np.array(distances), axis=0)
    return 0 if first > CLEARER * second else 1 if second > CLEARER * first else -1


def _compute_median(q: Complex[NDArray[np.complex128], "n r"]) -> Complex[NDArray[np.complex128], " n"]:
    """Median over the available columns, with phases relative to the first of them."""
    first = q[np.arange(len(q)), np.argmax(np.isfinite(q), axis=1)]
    apart = wrap_phases(q - first[:, None])
    median = np.median if np.isfinite(apart).all() else np.nanmedian  # nanmedian takes ten times as long
    return np.asarray(first + median(apart.real, axis=1) + 1j * median(apart.imag, axis=1))
