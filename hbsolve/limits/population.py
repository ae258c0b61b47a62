"""A first estimate of the limits: a population of slider states is continued along frequency, the best are improved."""

from collections.abc import Mapping, Sequence

import numpy as np

from hbsolve.limits.local_search import LimitSide, local_search
from hbsolve.limits.optimum import LimitKey, Optima, continue_optimum, improve, keep_if_better
from hbsolve.limits.point import LimitPoint, SearchStart, Sliders, TrialState
from hbsolve.limits.problem import LimitCurve
from reduction.array_type import Real

#: Number of members with different values from which local searches start, besides the optimum of the frequency before,
#: inside the band and at its ends, which have only one neighbour.
N_BEST, N_BEST_AT_END = 2, 6
#: Relative difference up to which values count as those of the same state.
SAME_STATE = 1e-4


def find_first_limits(curve: LimitCurve, indices: Sequence[int], starts: Sequence[Sliders]) -> Optima:
    """Limits at the frequencies of `indices`, in order."""
    # A sweep stays on its branch, and sweeps up and down follow different branches.
    up = sweep_states(curve, indices, starts)
    down = sweep_states(curve, indices[::-1], starts)
    chosen: dict[LimitKey, list[SearchStart]] = {}
    for index in indices:
        box, count = curve.box, count_starts(curve, index)
        for side in LimitSide:
            states = _select_distinct([*up[index], *down[index]], side, count)
            chosen[index, side] = [(trial.motion, box.clip(trial.periodic_slider)) for trial in states]
    return improve_along(curve, indices, chosen)


def count_starts(curve: LimitCurve, index: int) -> int:
    """Number of local searches for each side at a frequency, besides that from the frequency before."""
    return N_BEST_AT_END if index in (0, len(curve.angular_frequency) - 1) else N_BEST


def improve_along(
    curve: LimitCurve, indices: Sequence[int], chosen: Mapping[LimitKey, Sequence[SearchStart]]
) -> Optima:
    """Limits at frequencies in order, from start motions and sliders at each, and from the previous limit."""
    best: Optima = {}
    for index in indices:
        point = curve.point(index)
        for side in LimitSide:
            for x, w in chosen.get((index, side), ()):
                improve(point, best, (index, side), x, w)
            if (index - 1, side) in best:
                settled = continue_optimum(curve, side, best[index - 1, side], index - 1, index)
                keep_if_better(best, (index, side), settled and local_search(point, settled, side))
    return best


def sweep_states(curve: LimitCurve, indices: Sequence[int], starts: Sequence[Sliders]) -> dict[int, list[TrialState]]:
    """States of the members at frequencies in the order of `indices`, each continued from the frequency before."""
    result: dict[int, list[TrialState]] = {}
    members = list(starts)
    motions: list[Real | None] = [None] * len(members)
    for index in indices:
        point = curve.point(index)
        result[index] = []
        for number, w in enumerate(members):
            motion = motions[number]
            trial = None if motion is None else point.solve(motion, w)
            trial = trial or _from_others(point, w, result[index])
            motions[number] = None if trial is None else trial.motion
            if trial is not None:
                # The homotopy to a member may have ended at other sliders.
                members[number] = trial.initial_slider
                result[index].append(trial)
    return result


def _from_others(point: LimitPoint, w: Sliders, solved: Sequence[TrialState]) -> TrialState | None:
    """State found from the nearest solved member or, if there is none, from rest."""
    if solved:
        nearest = min(solved, key=lambda trial: float(np.linalg.norm(trial.initial_slider - w)))
        return point.towards(w, nearest)
    return point.from_rest(w) or point.from_anywhere(w)


def _select_distinct(solved: Sequence[TrialState], side: LimitSide, count: int) -> list[TrialState]:
    result: list[TrialState] = []
    for trial in sorted(solved, key=lambda trial: -side * trial.value):
        if all(abs(trial.value - other.value) > SAME_STATE * abs(other.value) for other in result):
            result.append(trial)
        if len(result) == count:
            break
    return result
