"""Limits carried over gaps between branches.

Near a fold a limit's state may not exist at the next frequency with the sliders that it has, while that from two
frequencies on does, or one to which the motion drags them. There neighbours further away are tried, and where no state
is near theirs the solver tries all that it can: what costs a hundred times as much is worth it at these few points.
"""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.limits.exchange import HOPELESS
from hbsolve.limits.improve import improve
from hbsolve.limits.local_search import GAIN, LimitSide
from hbsolve.limits.optimum import Best
from hbsolve.limits.problem import LimitProblem

#: A limit that is better than its neighbour's state followed here by this share is not of the same branch.
APART = 5e-3
#: Neighbours that are tried are so many frequencies away at most, and worse by this share at most.
FURTHEST, WORSE = 3, 0.1


def at_a_gap(best: Best) -> set[tuple[int, LimitSide]]:
    """Limits on either side of a gap between branches."""
    found = set()
    for (at, side), held in best.items():
        for step in (-1, 1):
            if (at + step, side) not in best:
                continue
            followed = held.followed.get(step)
            if followed is None or side * (held.value - followed) > APART * abs(held.value):
                found |= {(at, side), (at + step, side)}
    return found


def bridged(
    problem: LimitProblem, level: float, omega: Float[NDArray[np.float64], " f"], best: Best,
    keys: Iterable[tuple[int, LimitSide]],
) -> tuple[Best, set[tuple[int, LimitSide]]]:  # fmt: skip
    """Try neighbours' optima at some frequencies once more; returns the limits and which of them improved."""
    best, gained = dict(best), set()
    for at, side in keys:
        point = problem.at(float(omega[at]), level)
        for away in sorted(range(-FURTHEST, FURTHEST + 1), key=abs):
            source = best.get((at + away, side))
            if away == 0 or source is None:
                continue
            if side * point.gain(source.value, best[at, side].value) < -WORSE:
                continue
            trial = point.settle(source.x, source.w) or point.from_anywhere(source.w)
            if trial is None or side * point.gain(trial.value, best[at, side].value) < -HOPELESS:
                continue
            if improve(point, best, at, side, trial.x, trial.w, repaired=source.repaired) > 10 * GAIN:
                gained.add((at, side))
    return best, gained
