r"""Settling: repeats of a response that still changes, such as that of a joint that runs in.

The curve of a repeat differs from the mean of all by a frequency shift and a factor,
:math:`X_r - \bar X \approx \delta_r\,\mathrm{d}\bar X / \mathrm{d} \ln f + \gamma_r \bar X`. In true repeats both are
random. In a settling response they change from repeat to repeat in one direction, by decreasing amounts.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray
from scipy.special import stdtr

from correlation.campaign.measurement import Campaign, Mask
from correlation.feature.curve import CurveSet, list_curves

#: Least number of repeats for a trend, and least number for a test by ranks alone: seven are in order by chance in 1 of
#: 2,520 cases.
FEWEST, BY_RANK = 4, 7
#: Significance level of the rank order [-].
CHANCE = 0.002
#: Largest ratio of the last to the first step of a monotone sequence, by the number of repeats [-]: by chance this
#: occurs in 1 of 250 to 1,000 cases.
LAST = {4: 0.1, 5: 0.5, 6: 1.0}
#: Share of the total change within which the last repeats count as settled [-].
SETTLED = 0.25


@dataclass(frozen=True, kw_only=True, eq=False)
class Drift:
    """Differences between the repeats of one configuration, in the order in which they were measured.

    Parameters
    ----------
    free
        Whether it is the structure without its contacts.
    repeat
        Numbers of the repeats, shape (R,).
    frequency, amplitude
        Relative shift of the frequencies and relative change of the amplitude, mean over levels and sweeps, shape (R,).
    """

    free: bool
    repeat: Int[NDArray[np.int64], " R"]
    frequency: Float[NDArray[np.float64], " R"]
    amplitude: Float[NDArray[np.float64], " R"]

    @property
    def settles(self) -> tuple[str, ...]:
        """Quantities with a trend: "frequency", "amplitude", both or none."""
        both = (("frequency", self.frequency), ("amplitude", self.amplitude))
        return tuple(name for name, change in both if is_ordered(change))

    @property
    def settled(self) -> Bool[NDArray[np.bool_], " R"]:
        """Mask of the last repeats that differ by a small share of the total change; at least the last one, (R,)."""
        result = np.ones(len(self.repeat), dtype=bool)
        for change in (self.frequency, self.amplitude):
            if is_ordered(change):
                result &= np.abs(change - change[-1]) <= SETTLED * np.ptp(change)
        return result


def find_drifts(campaign: Campaign) -> list[Drift]:
    """Drift of each configuration with enough repeats."""
    curves = list_curves(campaign)
    drifts = []
    for free in sorted({item.free for item in curves}):
        own = [item for item in curves if item.free == free]
        repeats = _order_repeats(campaign, own)
        if len(repeats) < FEWEST:
            continue
        changes = np.array([change for item in own for change in _list_changes(item, repeats)])
        if len(changes):
            frequency, amplitude = np.nanmean(changes, axis=0).T
            drifts.append(Drift(free=free, repeat=repeats, frequency=frequency, amplitude=amplitude))
    return drifts


def is_ordered(change: Float[NDArray[np.float64], " R"]) -> bool:
    """Whether a sequence has a significant trend."""
    if not np.isfinite(change).all() or len(change) < FEWEST:
        return False
    return _is_first_apart(change) or _runs_on(change)


def _is_first_apart(change: Float[NDArray[np.float64], " R"]) -> bool:
    """Whether the first value is far from all others by Student's test, and the second one deviates to the same side.

    In fast settling the repeats from the third one on differ only by scatter.
    """
    rest = change[1:]
    apart, spread = change[0] - rest.mean(), rest.std(ddof=1) * np.sqrt(1 + 1 / len(rest))
    chance = 2 * stdtr(len(rest) - 1, -abs(apart) / max(spread, np.finfo(float).tiny))
    return bool(chance < CHANCE and (change[1] - change[2:].mean()) * apart > 0)


def _runs_on(change: Float[NDArray[np.float64], " R"]) -> bool:
    """Whether the sequence has a trend by rank correlation; with few repeats, is monotone with decreasing steps."""
    if len(change) >= BY_RANK:
        from scipy.stats import kendalltau

        return bool(kendalltau(np.arange(len(change)), change).pvalue < CHANCE)
    step = np.diff(change)
    falling = all(abs(after) < abs(before) for before, after in pairwise(step))
    share = LAST[min(len(change), BY_RANK - 1)]
    return bool((np.all(step > 0) or np.all(step < 0)) and falling and abs(step[-1]) < share * abs(step[0]))


def find_unsettled(campaign: Campaign) -> Mask:
    """Rows of early repeats of tests that the manifest marks as settling, shape (k,); they are not used in fits."""
    table, unsettled = campaign.measurement, np.zeros(len(campaign.measurement), dtype=bool)
    if not any(test.settling for test in campaign.tests):
        return unsettled
    settling = np.array([test.settling for test in campaign.tests])[table.test]
    free = campaign.is_free[table.test]
    for drift in find_drifts(campaign):
        early = drift.repeat[~drift.settled]
        unsettled |= settling & (free == drift.free) & np.isin(table.repeat, early)
    return unsettled


def _order_repeats(campaign: Campaign, curves: list[CurveSet]) -> Int[NDArray[np.int64], " R"]:
    """Repeats in the mean order of their readings."""
    table = campaign.measurement
    numbers = np.unique(np.concatenate([item.repeat for item in curves]))
    return np.asarray(numbers[np.argsort([table.order[table.repeat == item].mean() for item in numbers])])


def _list_changes(
    curves: CurveSet, repeats: Int[NDArray[np.int64], " R"]
) -> Iterator[Float[NDArray[np.float64], "R 2"]]:
    """Shift and factor of each repeat, for each sweep of a level."""
    for way in np.unique(curves.sweep):
        rows = [np.flatnonzero((curves.sweep == way) & (curves.repeat == item)) for item in repeats]
        if any(len(row) != 1 for row in rows):
            continue
        value = curves.value[np.concatenate(rows)]
        value = value[:, np.isfinite(value).all(axis=0)]
        frequency = curves.frequency[np.isfinite(curves.value[np.concatenate(rows)]).all(axis=0)]
        if value.shape[1] >= 5:
            yield np.array([_fit(frequency, value.mean(axis=0), item) for item in value])


def _fit(
    frequency: Float[NDArray[np.float64], " n"],
    mean: Complex[NDArray[np.complex128], " n"],
    value: Complex[NDArray[np.complex128], " n"],
) -> Float[NDArray[np.float64], "2"]:
    """Shift and factor by real least squares."""
    table = np.column_stack([np.gradient(mean, np.log(frequency)), mean])
    parts = np.concatenate([table.real, table.imag])
    apart = value - mean
    return np.asarray(np.linalg.lstsq(parts, np.concatenate([apart.real, apart.imag]), rcond=None)[0])
