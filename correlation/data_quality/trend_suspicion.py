"""Tests whose repeats have a trend with time, which a model of one structure cannot explain."""

from collections.abc import Iterator
from math import factorial

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_quality.repeat_trend import Trend, find_trend
from geometry.plain_number import format_number, percent

#: Significance level of a trend in any test of a campaign, equal to that of three standard deviations; and least
#: probability that is reported as a number [-].
CHANCE, LEAST_CHANCE = 0.0027, 1e-4
#: Least reported change from the first repeat to the last one, relative to the readings, root mean square; and least
#: reported one if the repeats are too few for a significant order. The usual differences of repeats, 0.03 % of
#: frequencies and 1 % of preloads, caused 1 to 5 % in 31 of 32 virtual tests [-].
LEAST, LARGE = 0.02, 0.1
#: Number of repeats whose order alone is significant: a chance of one in 2,520.
ENOUGH_REPEATS = 7
#: Least fraction of a change explained by its cause [-], and least number of points of a curve for its slope.
PLAIN, SLOPE = 0.8, 5

Change = Complex[NDArray[np.complex128], "s n"]


def find_trend_suspicions(campaign: Campaign) -> Iterator[Suspicion]:
    """Tests with a trend over the repeats; a remark if there are too few repeats for its significance.

    Parameters
    ----------
    campaign
        Campaign with its single readings.
    """
    sensors = campaign.structure_sensors
    for number, test in enumerate(campaign.tests):
        trend = find_trend(campaign.measurement.where(campaign.measurement.test == number), sensors)
        if trend is None or test.settling:
            continue  # the readings of a settling test are not repeats
        n_repeat, chance = len(trend.read.repeat), _format_chance(trend.chance)
        by_order = 2 / factorial(n_repeat)
        if trend.chance < CHANCE / len(campaign.tests) and trend.size >= LEAST:
            yield Suspicion(
                where=f'test "{test.name}"', of_time=True,
                headline=f'test "{test.name}" changed from repeat to repeat, which the case does not explain',
                sentence=f"{_describe(campaign, trend)}. Random differences between repeats do so in "
                f"{chance} of tests: did the structure change during the test, by wear, warming or a loosening bolt? "
                "Then their mean describes no single structure: compare the first and the last repeats separately",
            )  # fmt: skip
        elif n_repeat < ENOUGH_REPEATS and trend.chance <= by_order and trend.size >= LARGE:
            yield Suspicion(
                where=f'test "{test.name}"', of_time=True, remark=True,
                headline=f'whether the structure changed during test "{test.name}" is not clear',
                sentence=f"{_describe(campaign, trend)}. If such large differences between repeats are random, as by "
                f"preloads, {n_repeat} of them do so in {chance} of tests; if not, the structure changed during the "
                f"test, and their mean describes no single state: {ENOUGH_REPEATS - n_repeat} more repeats would "
                "decide",
            )  # fmt: skip


def _describe(campaign: Campaign, trend: Trend) -> str:
    """Size of a trend, and its cause if it is clear."""
    repeats, last = ", ".join(map(str, trend.read.repeat[:-1])), trend.read.repeat[-1]
    return (
        f"from repeat to repeat ({repeats} and {last}) the readings change in one direction, by {percent(trend.size)} "
        f"of their size from the first to the last (root mean square): {_name_cause(campaign, trend)}"
    )


def _format_chance(chance: float) -> str:
    return percent(chance) if chance >= LEAST_CHANCE else f"less than {percent(LEAST_CHANCE)}"


def _name_cause(campaign: Campaign, trend: Trend) -> str:
    """Cause of a trend: one sensor, the resonance frequencies, all amplitudes; otherwise the largest change."""
    change, mean = trend.change / trend.scale, trend.read.value.mean(axis=2) / trend.scale
    energy = (np.abs(change) ** 2).sum(axis=1)
    most = int(np.argmax(energy))
    if len(energy) > 1 and energy[most] >= PLAIN * energy.sum():
        return f'nearly all of it is of sensor "{campaign.sensors[trend.sensors[most]].name}"'
    for words, pattern in (
        ("the frequencies of resonances change by {}", -_find_slopes(trend, mean)),
        ("amplitudes change by {}", mean),
    ):
        factors, left = _fit(trend, change, pattern)
        if left <= (1 - PLAIN) * energy.sum():
            percents = dict.fromkeys(f"{format_number(100 * end, 2, '+')} %" for end in (factors.min(), factors.max()))
            return words.format(" to ".join(percents))
    ends = np.abs(trend.read.value[:, :, [0, -1]])
    apart = np.abs(ends[:, :, 1] - ends[:, :, 0]) / trend.scale
    sensor, point = divmod(int(np.argmax(apart)), apart.shape[1])
    first, last = ends[sensor, point].tolist()
    of = campaign.sensors[trend.sensors[sensor]]
    return (
        f"most of all {of.name} at {trend.read.level[point]:g} {campaign.drive.unit}, "
        f"{trend.read.frequency[point]:.4g} Hz, from {first:.3g} to {last:.3g} {of.unit}"
    )


def _find_slopes(trend: Trend, mean: Change) -> Change:
    """Slope of each curve over the logarithm of the frequency; zero for too short curves."""
    slope = np.zeros_like(mean)
    read = trend.read
    for level, sweep in {*zip(read.level.tolist(), read.sweep.tolist(), strict=True)}:
        rows = np.flatnonzero((read.level == level) & (read.sweep == sweep))
        rows = rows[np.argsort(read.frequency[rows])]
        if len(rows) >= SLOPE:
            slope[:, rows] = _differentiate(mean[:, rows], np.log(read.frequency[rows]))
    return slope


def _differentiate(value: Change, abscissa: Float[NDArray[np.float64], " n"]) -> Change:
    """Slope of curves: near a resonance from 1/X, for which a few points over a peak suffice, elsewhere from X."""
    high = np.abs(value) >= np.median(np.abs(value), axis=1, keepdims=True)
    inverse = np.divide(1.0, value, out=np.zeros_like(value), where=value != 0)
    over_peak = -(value**2) * np.gradient(inverse, abscissa, axis=1)
    return np.where(high, over_peak, np.gradient(value, abscissa, axis=1))


def _fit(trend: Trend, change: Change, pattern: Change) -> tuple[Float[NDArray[np.float64], " l"], float]:
    """Real factor of a pattern at each level by least squares, and residual over all levels."""
    number = np.unique(trend.read.level, return_inverse=True)[1]
    product, square = ((pattern.conj() * item).real.sum(axis=0) for item in (change, pattern))
    factor = np.bincount(number, product) / np.maximum(np.bincount(number, square), np.finfo(float).tiny)
    return factor, float((np.abs(change - factor[number] * pattern) ** 2).sum())
