"""The best state found so far (optimum) at each frequency of a level, its replacement, and its continuation."""

from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from hbsolve.limits.local_search import LimitSide, local_search
from hbsolve.limits.point import LimitPoint, Sliders, TrialState
from hbsolve.limits.problem import LimitCurve
from reduction.array_type import Real

#: Relative gain by which a state must be better to replace another.
BETTER = 1e-6
#: Relative difference up to which limits count as equal.
CLOSED = 1e-3
#: Number of steps to the next frequency if a single step fails, or has a relative loss above the second number; and
#: number of steps of the search at each.
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
    """Whether it, or an optimum from which it was continued, was found from a sampled state outside earlier limits."""
    starts: tuple[float, ...] = ()
    """Final values of local searches from different starts."""
    followed: dict[int, float] = field(default_factory=dict)
    """Values of the neighbours' states continued to this frequency, by the step to the neighbour, -1 or +1."""


#: Index of the frequency, and side.
LimitKey: TypeAlias = tuple[int, LimitSide]
#: Optima of one level.
Optima: TypeAlias = dict[LimitKey, Optimum]


def keep_if_better(best: Optima, key: LimitKey, trial: TrialState | None, *, repaired: bool = False) -> float:
    """Adopt a state if it is better than the optimum; returns the gain, relative to the previous optimum."""
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
    """Settle a state, search from it and keep a better result; returns the gain, relative to the previous optimum.

    `best` is changed in place; `repaired` is whether the state comes from an audit.
    """
    settled = point.settle(x, w)
    return keep_if_better(best, key, settled and local_search(point, settled, key[1]), repaired=repaired)


def continue_optimum(
    curve: LimitCurve, side: LimitSide, optimum: Optimum, before: int, after: int
) -> TrialState | None:
    """Continue the state of an optimum to another frequency, without improving it there.

    Branches end in folds: a little beyond one, a lower limit may no longer exist with its sliders, but with others. So
    if a single step fails or ends on another branch, smaller steps improve the sliders at intermediate frequencies.
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
    """Whether values at a frequency differ: both limits, or the ends of local searches."""
    here = [best[index, side] for side in LimitSide if (index, side) in best]
    values = np.concatenate([(optimum.value, *optimum.starts) for optimum in here])
    return bool(np.ptp(values) > CLOSED * np.abs(values).max())
