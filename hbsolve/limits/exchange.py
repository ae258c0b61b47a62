"""Optima that are handed on, to neighbours in frequency and to other levels.

A local search ends in the optimum of its basin. Neighbours often sit in a better one, and a state with all contacts
stuck has no gradient to leave it by.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.limits.follow import follow
from hbsolve.limits.improve import improve
from hbsolve.limits.local_search import GAIN, LimitSide, local_search
from hbsolve.limits.optimum import Best, Optimum, offer
from hbsolve.limits.problem import LimitProblem

Frequencies = Float[NDArray[np.float64], " f"]

#: A neighbour's state this share worse than what is there is not improved.
HOPELESS = 0.3
#: Sweeps back and forth over the frequencies.
SWEEPS = 6


def exchange(
    problem: LimitProblem, level: float, omega: Frequencies, numbers: Sequence[int], best: Best,
    fresh: Iterable[tuple[int, LimitSide]],
) -> Best:  # fmt: skip
    """Hand optima to neighbours until no limit improves; only those that are `fresh` are handed on at first.

    `best` also holds the neighbours of the first and the last frequency, which are not improved. Returns what is there
    at `numbers`.
    """
    best, own = dict(best), set(numbers)
    waiting = set(fresh)
    for sweep in range(SWEEPS):
        step = 1 if sweep % 2 == 0 else -1
        gained: set[tuple[int, LimitSide]] = set()
        for at in sorted(own, reverse=step > 0):
            for side in LimitSide:
                source = best.get((at + step, side))
                if source is None or (at + step, side) not in waiting | gained:
                    continue
                if _follow(problem, level, omega, at, side, step, source, best) > GAIN:
                    gained.add((at, side))
        # What the first sweep did not hand on forwards, the second one hands on backwards.
        waiting = gained | (waiting if sweep == 0 else set())
        if not waiting:
            break
    return {key: value for key, value in best.items() if key[0] in own}


def _follow(
    problem: LimitProblem,
    level: float,
    omega: Frequencies,
    at: int,
    side: LimitSide,
    step: int,
    source: Optimum,
    best: Best,
) -> float:
    """Try a neighbour's optimum at a frequency; the gain."""
    point = problem.at(float(omega[at]), level)
    trial = follow(problem, level, side, source, float(omega[at + step]), float(omega[at]))
    held = best.get((at, side))
    if trial is None:
        return 0.0
    gain = 0.0
    if held is None or side * point.gain(trial.value, held.value) > -HOPELESS:
        trial = local_search(point, trial, side)
        gain = offer(best, at, side, trial, repaired=source.repaired)
    best[at, side] = replace(best[at, side], followed=best[at, side].followed | {step: trial.value})
    return gain


def from_level(
    problem: LimitProblem, level: float, omega: Frequencies, numbers: Sequence[int], best: Best, other: float,
    optima: Best,
) -> tuple[Best, set[tuple[int, LimitSide]]]:  # fmt: skip
    """Try the optima of another level; returns the limits and which of them improved."""
    best, gained = dict(best), set()
    for at in numbers:
        point = problem.at(float(omega[at]), level)
        for side in LimitSide:
            source, held = optima.get((at, side)), best.get((at, side))
            if source is None:
                continue
            guess = source.x.copy()
            guess[:, 1:] *= level / other
            trial = point.solve(guess, source.w)
            if trial is None and held is not None:
                trial = point.towards(source.w, point.trial(held.x, held.w, held.residual))
            if trial is None:
                continue
            if held is not None:
                change = side * point.gain(trial.value, held.value)
                if change < -HOPELESS or abs(change) < 0.1 * GAIN:
                    continue
            if improve(point, best, at, side, trial.x, trial.w, repaired=source.repaired) > 10 * GAIN:
                gained.add((at, side))
    return best, gained
