"""A limit's state at the next frequency."""

from hbsolve.limits.local_search import LimitSide, local_search
from hbsolve.limits.optimum import Optimum
from hbsolve.limits.point import TrialState
from hbsolve.limits.problem import LimitProblem

#: Steps from a frequency to the next where one fails, or makes the state worse by more than a share, and the steps of
#: the search at each.
STEPS, WORSE, SEARCH = 4, 0.05, 6


def follow(
    problem: LimitProblem, level: float, side: LimitSide, optimum: Optimum, before: float, after: float
) -> TrialState | None:
    """What an optimum at the frequency `before` becomes at the frequency `after`, not yet improved.

    Branches end in folds: with its sliders a lower limit may not exist any more a little further on, while with others
    it does. So where one step does not arrive, or on another branch, sliders are improved on the way in smaller ones.
    """
    point = problem.at(after, level)
    direct = point.settle(optimum.x, optimum.w)
    if direct is not None and side * point.gain(direct.value, optimum.value) > -WORSE:
        return direct
    x, w, value = optimum.x, optimum.w, optimum.value
    for number in range(1, STEPS + 1):
        there = problem.at(before + number / STEPS * (after - before), level)
        trial = there.settle(x, w)
        if trial is None:
            return direct
        if number < STEPS:
            trial = local_search(there, trial, side, SEARCH)
        x, w, value = trial.x, trial.w, trial.value
    return trial if direct is None or side * (value - direct.value) > 0 else direct
