"""An audit of limits by random histories, and their repair from the states that lie outside.

Searches that agree are no proof: on a small damper all seeds found the same wrong optimum. States that nobody chose are
independent of the search; those outside a limit are counted first, and then improved into a better one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.optimum import Best, Key, improve
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.random_histories import sampled_states

#: A state counts as outside beyond this share of the limit; repair begins much closer.
OUTSIDE, REPAIR = 1e-3, 1e-5
#: Sweeps begin and end so many frequencies outside a block: branches are reached by passing what comes before them.
RUN_IN = 3


@dataclass(frozen=True, kw_only=True)
class Audit:
    """Sampled states at one frequency and level.

    Parameters
    ----------
    count
        How many were found [-].
    lowest, highest
        Their values.
    below, above
        How many lay outside the limits by more than `OUTSIDE`, before any repair [-].
    """

    count: int
    lowest: float
    highest: float
    below: int
    above: int


def audit(
    curve: LimitCurve, numbers: Sequence[int], best: Best, count: int, seed: Sequence[int]
) -> tuple[Best, set[Key], dict[int, Audit]]:
    """Sample histories at a level; returns the repaired limits, which of them were, and the counts before."""
    best, repaired = dict(best), set()
    swept = range(max(numbers[0] - RUN_IN, 0), min(numbers[-1] + RUN_IN + 1, len(curve.angular_frequency)))
    sampled = sampled_states(curve, swept, count, seed)
    audits = {}
    for row, at in enumerate(swept):
        if at not in numbers:
            continue
        values = sampled.value[row][np.isfinite(sampled.value[row])]
        point = curve.point(at)
        outside = {}
        for side in LimitSide:
            limit = best.get((at, side))
            excess = [side * point.gain(value, limit.value) for value in values] if limit else [np.inf] * len(values)
            outside[side] = int((np.array(excess) > OUTSIDE).sum())
            if not len(values) or max(excess) <= REPAIR:
                continue
            if improve(point, best, (at, side), *sampled.extreme[at, side], repaired=True) > 0:
                repaired.add((at, side))
        audits[at] = Audit(
            count=len(values),
            lowest=float(values.min(initial=np.inf)),
            highest=float(values.max(initial=-np.inf)),
            below=outside[LimitSide.LOWER],
            above=outside[LimitSide.UPPER],
        )
    return best, repaired, audits
