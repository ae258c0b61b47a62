"""Continuation of optima: to neighbours in frequency, across gaps between branches and to other levels.

A local search ends in the optimum of its basin. Neighbours are often in a better basin, and a state with all contacts
stuck has no gradient. Near a fold the state of a limit may not exist at the next frequency with its sliders, while the
state of the next but one does, or a state with the sliders dragged by the motion. There neighbours further away are
tried, and if no state is near theirs the solver tries all its starts, at a hundred times the cost.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from hbsolve.limits.local_search import GAIN, LimitSide, local_search
from hbsolve.limits.optimum import LimitKey, Optima, continue_optimum, improve, keep_if_better
from hbsolve.limits.problem import LimitCurve

#: Relative loss to the optimum above which a neighbour's state is not improved.
MAX_RELATIVE_LOSS = 0.3
#: Largest number of sweeps back and forth over the frequencies.
SWEEPS = 6
#: Relative gain of a limit over its neighbour's state, continued to its frequency, above which it is on another branch.
OTHER_BRANCH = 5e-3
#: Largest number of frequencies to a neighbour that is tried across a gap, and its largest relative loss.
FURTHEST, WORSE = 3, 0.1


def continue_to_neighbours(
    curve: LimitCurve, indices: Sequence[int], best: Optima, fresh: Iterable[LimitKey]
) -> Optima:
    """Continue optima to neighbours until no limit improves, beginning with those that are `fresh`.

    `best` also has the neighbours of the first and the last frequency, which are not improved. Returns the optima at
    `indices`.
    """
    best, own = dict(best), set(indices)
    waiting = set(fresh)
    for sweep in range(SWEEPS):
        step = 1 if sweep % 2 == 0 else -1
        gained: set[LimitKey] = set()
        for index in sorted(own, reverse=step > 0):
            for side in LimitSide:
                source = index + step, side
                if (
                    source in best
                    and source in waiting | gained
                    and _take_over(curve, best, source, (index, side)) > GAIN
                ):
                    gained.add((index, side))
        # Fresh optima, which the first sweep continues in one direction, the second continues in the other.
        waiting = gained | (waiting if sweep == 0 else set())
        if not waiting:
            break
    return {key: value for key, value in best.items() if key[0] in own}


def _take_over(curve: LimitCurve, best: Optima, source: LimitKey, key: LimitKey) -> float:
    """Try a neighbour's optimum at a frequency; returns the relative gain."""
    (index, side), neighbour, present = key, best[source], best.get(key)
    point = curve.point(index)
    trial = continue_optimum(curve, side, neighbour, source[0], index)
    if trial is None:
        return 0.0
    gain = 0.0
    if present is None or side * point.gain(trial.value, present.value) > -MAX_RELATIVE_LOSS:
        trial = local_search(point, trial, side)
        gain = keep_if_better(best, key, trial, repaired=neighbour.repaired)
    best[key] = replace(best[key], followed=best[key].followed | {source[0] - index: trial.value})
    return gain


def continue_from_level(
    curve: LimitCurve, indices: Sequence[int], best: Optima, other: float, optima: Optima
) -> tuple[Optima, set[LimitKey]]:
    """Try the optima of another level; returns the optima and the keys of those that improved."""
    best, gained = dict(best), set()
    for key in ((index, side) for index in indices for side in LimitSide if (index, side) in optima):
        point, source, present = curve.point(key[0]), optima[key], best.get(key)
        guess = source.motion.copy()
        guess[:, 1:] *= curve.level / other
        trial = point.solve(guess, source.initial_slider)
        if trial is None and present is not None:
            trial = point.towards(
                source.initial_slider, point.trial(present.motion, present.initial_slider, present.residual_norm)
            )
        if trial is None:
            continue
        if present is not None:
            change = key[1] * point.gain(trial.value, present.value)
            if change < -MAX_RELATIVE_LOSS or abs(change) < 0.1 * GAIN:
                continue
        if improve(point, best, key, trial.motion, trial.initial_slider, repaired=source.repaired) > 10 * GAIN:
            gained.add(key)
    return best, gained


def find_gaps(best: Optima) -> set[LimitKey]:
    """Keys of the limits on either side of gaps between branches."""
    result = set()
    for (index, side), optimum in best.items():
        for step in (-1, 1):
            if (index + step, side) not in best:
                continue
            followed = optimum.followed.get(step)
            if followed is None or side * (optimum.value - followed) > OTHER_BRANCH * abs(optimum.value):
                result |= {(index, side), (index + step, side)}
    return result


def continue_across_gaps(curve: LimitCurve, best: Optima, keys: Iterable[LimitKey]) -> tuple[Optima, set[LimitKey]]:
    """Try neighbours' optima at some frequencies again; returns the optima and the keys of those that improved."""
    best, gained = dict(best), set()
    for index, side in keys:
        point = curve.point(index)
        for away in sorted(range(-FURTHEST, FURTHEST + 1), key=abs):
            source = best.get((index + away, side))
            if away == 0 or source is None:
                continue
            if side * point.gain(source.value, best[index, side].value) < -WORSE:
                continue
            trial = point.settle(source.motion, source.initial_slider) or point.from_anywhere(source.initial_slider)
            if trial is None or side * point.gain(trial.value, best[index, side].value) < -MAX_RELATIVE_LOSS:
                continue
            if (
                improve(point, best, (index, side), trial.motion, trial.initial_slider, repaired=source.repaired)
                > 10 * GAIN
            ):
                gained.add((index, side))
    return best, gained
