r"""Settling: readings of a response that still changes, such as a joint that runs in, posed as repeats.

The curve of a repeat differs from the mean of all by a shift of its frequencies and by a factor,
:math:`X_r - \bar X \approx \delta_r\,\mathrm{d}\bar X / \mathrm{d} \ln f + \gamma_r \bar X`. Repeats have them at
random. A response that settles has them in order: from repeat to repeat in one direction, by less and less.
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

#: Repeats that can show an order, and those from which their ranks alone do: seven in order are one in 2,520.
FEWEST, BY_RANK = 4, 7
#: Chance of an order of ranks among repeats without one [-].
CHANCE = 0.002
#: Share of the first step that is left of the last one where fewer repeats run in one direction, by their number [-]:
#: repeats without an order do so once in some 250 to 1,000.
LAST = {4: 0.1, 5: 0.5, 6: 1.0}
#: Share of the whole change within which the last repeats count as settled [-].
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
        """The last repeats, which differ by a small share of the whole change; at least the last one, shape (R,)."""
        result = np.ones(len(self.repeat), dtype=bool)
        for change in (self.frequency, self.amplitude):
            if is_ordered(change):
                result &= np.abs(change - change[-1]) <= SETTLED * np.ptp(change)
        return result


def find_drifts(campaign: Campaign) -> list[Drift]:
    """Drift of each configuration that has enough repeats."""
    curves = list_curves(campaign)
    drifts = []
    for free in sorted({item.free for item in curves}):
        own = [item for item in curves if item.free == free]
        repeats = _in_order(campaign, own)
        if len(repeats) < FEWEST:
            continue
        changes = np.array([change for item in own for change in _changes(item, repeats)])
        if len(changes):
            frequency, amplitude = np.nanmean(changes, axis=0).T
            drifts.append(Drift(free=free, repeat=repeats, frequency=frequency, amplitude=amplitude))
    return drifts


def is_ordered(change: Float[NDArray[np.float64], " R"]) -> bool:
    """Whether a sequence runs in one direction more than chance makes it."""
    if not np.isfinite(change).all() or len(change) < FEWEST:
        return False
    return _is_first_apart(change) or _runs_on(change)


def _is_first_apart(change: Float[NDArray[np.float64], " R"]) -> bool:
    """Whether the first one is far from all others, by Student's test of one against the rest, and the second after it.

    What settles fast is in the scatter of the repeats from the third one on.
    """
    rest = change[1:]
    apart, spread = change[0] - rest.mean(), rest.std(ddof=1) * np.sqrt(1 + 1 / len(rest))
    chance = 2 * stdtr(len(rest) - 1, -abs(apart) / max(spread, np.finfo(float).tiny))
    return bool(chance < CHANCE and (change[1] - change[2:].mean()) * apart > 0)


def _runs_on(change: Float[NDArray[np.float64], " R"]) -> bool:
    """Whether it runs in one direction; where few repeats would by chance, by less and less."""
    if len(change) >= BY_RANK:
        from scipy.stats import kendalltau

        return bool(kendalltau(np.arange(len(change)), change).pvalue < CHANCE)
    step = np.diff(change)
    falling = all(abs(after) < abs(before) for before, after in pairwise(step))
    share = LAST[min(len(change), BY_RANK - 1)]
    return bool((np.all(step > 0) or np.all(step < 0)) and falling and abs(step[-1]) < share * abs(step[0]))


def find_unsettled(campaign: Campaign) -> Mask:
    """Rows of early repeats of the tests that the manifest calls settling, shape (k,): no fit uses them."""
    table, unsettled = campaign.measurement, np.zeros(len(campaign.measurement), dtype=bool)
    if not any(test.settling for test in campaign.tests):
        return unsettled
    settling = np.array([test.settling for test in campaign.tests])[table.test]
    free = campaign.is_free[table.test]
    for drift in find_drifts(campaign):
        early = drift.repeat[~drift.settled]
        unsettled |= settling & (free == drift.free) & np.isin(table.repeat, early)
    return unsettled


def _in_order(campaign: Campaign, curves: list[CurveSet]) -> Int[NDArray[np.int64], " R"]:
    """Repeats by the mean order of their readings."""
    table = campaign.measurement
    numbers = np.unique(np.concatenate([item.repeat for item in curves]))
    return np.asarray(numbers[np.argsort([table.order[table.repeat == item].mean() for item in numbers])])


def _changes(curves: CurveSet, repeats: Int[NDArray[np.int64], " R"]) -> Iterator[Float[NDArray[np.float64], "R 2"]]:
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
    """Shift and factor by least squares of real numbers."""
    table = np.column_stack([np.gradient(mean, np.log(frequency)), mean])
    parts = np.concatenate([table.real, table.imag])
    apart = value - mean
    return np.asarray(np.linalg.lstsq(parts, np.concatenate([apart.real, apart.imag]), rcond=None)[0])
