"""The best state found so far at each frequency of a level."""

from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.point import TrialState

#: A state takes the place of another if it is better by this share.
BETTER = 1e-6
#: Limits that differ by less than this share are one.
CLOSED = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum:
    """One limit at one frequency and level.

    Parameters
    ----------
    value
        Of the objective.
    x, w
        Motion of the directions, shape (d, nh) [m], and slider positions, shape (s,) [m].
    residual
        |R| relative to the linear motion [-].
    repaired
        Whether it, or what it came from, was found from a sampled state that lay outside the limits before.
    starts
        Values at which local searches from different starts ended.
    followed
        What the neighbours' states became here: value by the step to the neighbour, -1 or +1.
    """

    value: float
    x: Float[NDArray[np.float64], "d nh"]
    w: Float[NDArray[np.float64], " s"]
    residual: float
    repaired: bool = False
    starts: tuple[float, ...] = ()
    followed: dict[int, float] = field(default_factory=dict)


#: By number of the frequency and side, of one level.
Best: TypeAlias = dict[tuple[int, LimitSide], Optimum]


def offer(best: Best, at: int, side: LimitSide, trial: TrialState | None, *, repaired: bool = False) -> float:
    """Take a state where it is better than what is there; returns the gain, relative to what was there."""
    if trial is None:
        return 0.0
    held = best.get((at, side))
    size = max(abs(held.value), np.finfo(float).tiny) if held else 1.0
    gain = side * (trial.value - held.value) / size if held else np.inf
    starts = (*(held.starts if held else ()), trial.value)
    if held and gain <= BETTER:
        best[at, side] = replace(held, starts=starts)
        return 0.0
    best[at, side] = Optimum(
        value=trial.value,
        x=trial.x,
        w=trial.w,
        residual=trial.residual,
        repaired=repaired,
        starts=starts,
        followed=held.followed if held else {},
    )
    return gain


def is_open(best: Best, at: int) -> bool:
    """Whether there is more than one value at a frequency: between both limits, or between ends of local searches."""
    values = np.concatenate(
        [(best[at, side].value, *best[at, side].starts) for side in LimitSide if (at, side) in best]
    )
    return bool(np.ptp(values) > CLOSED * np.abs(values).max())
