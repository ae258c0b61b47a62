"""The best state found so far at each frequency of a level, what takes its place, and what it becomes elsewhere."""

from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from hbsolve.limits.local_search import LimitSide, local_search
from hbsolve.limits.point import LimitPoint, Sliders, TrialState
from hbsolve.limits.problem import LimitCurve
from reduction.array_type import Real

#: A state takes the place of another if it is better by this share.
BETTER = 1e-6
#: Limits that differ by less than this share are one.
CLOSED = 1e-3
#: Steps from a frequency to the next where one fails, or makes the state worse by more than a share, and the steps of
#: the search at each.
STEPS, WORSE, SEARCH = 4, 0.05, 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum:
    """One limit at one frequency and level."""

    value: float
    """Value of the objective."""
    motion: Float[Real, "d nh"]
    initial_slider: Float[Real, " s"]
    """Motion of the directions, shape (d, nh) [m], and slider positions, shape (s,) [m]."""
    residual_norm: float
    """|R| relative to the linear motion [-]."""
    repaired: bool = False
    """Whether it, or what it came from, was found from a sampled state that lay outside the limits before."""
    starts: tuple[float, ...] = ()
    """Values at which local searches from different starts ended."""
    followed: dict[int, float] = field(default_factory=dict)
    """Values that the neighbours' states have here, by the step to the neighbour, -1 or +1."""


#: Index of the frequency, and side.
LimitKey: TypeAlias = tuple[int, LimitSide]
#: Optima of one level.
Optima: TypeAlias = dict[LimitKey, Optimum]


def keep_if_better(best: Optima, key: LimitKey, trial: TrialState | None, *, repaired: bool = False) -> float:
    """Take a state where it is better than the optimum; returns the gain, relative to the optimum before."""
    if trial is None:
        return 0.0
    before = best.get(key)
    size = max(abs(before.value), np.finfo(float).tiny) if before else 1.0
    gain = key[1] * (trial.value - before.value) / size if before else np.inf
    starts = (*(before.starts if before else ()), trial.value)
    if before and gain <= BETTER:
        best[key] = replace(before, starts=starts)
        return 0.0
    best[key] = Optimum(
        value=trial.value, motion=trial.motion, initial_slider=trial.initial_slider, residual_norm=trial.residual_norm,
        repaired=repaired, starts=starts, followed=before.followed if before else {},
    )  # fmt: skip
    return gain


def improve(point: LimitPoint, best: Optima, key: LimitKey, x: Real, w: Sliders, *, repaired: bool = False) -> float:
    """Settle a state, search from it and keep a better result; returns the gain, relative to the optimum before.

    `best` is changed in place; `repaired` says that the state comes from an audit.
    """
    settled = point.settle(x, w)
    return keep_if_better(best, key, settled and local_search(point, settled, key[1]), repaired=repaired)


def continue_optimum(
    curve: LimitCurve, side: LimitSide, optimum: Optimum, before: int, after: int
) -> TrialState | None:
    """The state that an optimum becomes at another frequency; not yet improved there.

    Branches end in folds: with its sliders a lower limit may not exist any more a little further on, while with others
    it does. So where one step does not arrive, or on another branch, sliders are improved on the way in smaller ones.
    """
    direct = curve.point(after).settle(optimum.motion, optimum.initial_slider)
    if direct is not None and side * curve.point(after).gain(direct.value, optimum.value) > -WORSE:
        return direct
    first, last = (float(curve.angular_frequency[index]) for index in (before, after))
    x, w, value = optimum.motion, optimum.initial_slider, optimum.value
    for number in range(1, STEPS + 1):
        there = curve.problem.at(first + number / STEPS * (last - first), curve.level)
        trial = there.settle(x, w)
        if trial is None:
            return direct
        if number < STEPS:
            trial = local_search(there, trial, side, SEARCH)
        x, w, value = trial.motion, trial.initial_slider, trial.value
    return trial if direct is None or side * (value - direct.value) > 0 else direct


def is_open(best: Optima, index: int) -> bool:
    """Whether there is more than one value at a frequency: between both limits, or between ends of local searches."""
    here = [best[index, side] for side in LimitSide if (index, side) in best]
    values = np.concatenate([(optimum.value, *optimum.starts) for optimum in here])
    return bool(np.ptp(values) > CLOSED * np.abs(values).max())
