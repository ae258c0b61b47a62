"""Steady states of one population and of random histories, shared by the limits of several objectives.

The states of a system do not depend on the objective. So they are computed once; the local searches of each objective
then start from its outermost states.

A contact that lifts off has branches that no change of sliders reaches: they are connected over the level, round folds.
So at each frequency an arc over the level adds the states of all branches that it passes.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from hbsolve.continuation.multiple_states import find_motions_along_the_level
from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.objective import Objective
from hbsolve.limits.optimum import LimitKey
from hbsolve.limits.point import ANY_RATIO, LimitPoint, SearchStart, Sliders, TrialState
from hbsolve.limits.population import SAME_STATE, count_starts, sweep_states
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.random_histories import RUN_IN, random_states
from hbsolve.state import make_initial_sliders
from reduction.array_type import Real


@dataclass(frozen=True, kw_only=True, eq=False)
class SharedStates:
    """States at some frequencies of one level, with the values of o objectives."""

    starts: tuple[Mapping[LimitKey, Sequence[SearchStart]], ...]
    """Outermost states by objective, frequency and side."""
    sampled: Mapping[int, Float[Real, "2 o"]]
    """Lowest and highest value of the random histories by frequency, shape (2, o); NaN without histories."""
    count: Mapping[int, int]
    """Number of random histories by frequency [-]."""
    reached: Mapping[int, Float[Real, "2 o"]]
    """Lowest and highest value of all states, including the population, by frequency, shape (2, o)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _EvaluatedState:
    """One state with the values of o objectives, and whether it belongs to a random history."""

    start: SearchStart
    value: Float[Real, " o"]
    is_random: bool


def share_histories(
    curve: LimitCurve,
    indices: Sequence[int],
    objectives: Sequence[Objective],
    population: Sequence[Sliders],
    count: int,
    seed: Sequence[int],
    *,
    branches: bool = True,
) -> SharedStates:
    """Continue a population and random histories along the frequencies of `indices`, up and down.

    Parameters
    ----------
    curve
        System, level and all frequencies; its own objective is not used.
    indices
        Indices of the frequencies.
    objectives
        Objectives whose limits are sought.
    population
        Initial sliders of the population.
    count
        Number of random histories [-].
    seed
        Seed of the random histories.
    branches
        Whether an arc over the level searches for branches that no change of sliders reaches, the most expensive part.
    """
    swept = range(max(indices[0] - RUN_IN, 0), min(indices[-1] + RUN_IN + 1, len(curve.angular_frequency)))
    evaluated: dict[int, list[_EvaluatedState]] = {index: [] for index in indices}
    balance, box, level = curve.problem.balance, curve.box, curve.level
    measures = {
        index: [item.measure(balance, curve.point(index).condensed) for item in objectives] for index in indices
    }

    def evaluate(index: int, trial: TrialState, is_random: bool) -> None:
        value = np.array([item.value(level, trial.motion, trial.forces.coefficients) for item in measures[index]])
        evaluated[index].append(
            _EvaluatedState(start=(trial.motion, box.clip(trial.periodic_slider)), value=value, is_random=is_random)
        )

    for order in (indices, indices[::-1]):
        for index, trials in sweep_states(curve, order, population).items():
            for trial in trials:
                evaluate(index, trial, is_random=False)
    for index in indices if branches else ():
        for trial in _list_branches(curve.point(index)):
            evaluate(index, trial, is_random=False)
    for row, _, trial in random_states(curve, swept, count, seed):
        if swept[row] in evaluated:
            evaluate(swept[row], trial, is_random=True)
    starts: list[dict[LimitKey, Sequence[SearchStart]]] = [{} for _ in objectives]
    for index, states in evaluated.items():
        for number, chosen in enumerate(starts):
            for side in LimitSide:
                chosen[index, side] = _select_furthest(states, number, side, count_starts(curve, index))
    random = {index: np.array([item.value for item in states if item.is_random]) for index, states in evaluated.items()}
    return SharedStates(
        starts=tuple(starts),
        sampled={index: _find_ends(values, len(objectives)) for index, values in random.items()},
        count={index: len(values) for index, values in random.items()},
        reached={
            index: _find_ends(np.array([item.value for item in states]), len(objectives))
            for index, states in evaluated.items()
        },
    )


def _list_branches(point: LimitPoint) -> Iterator[TrialState]:
    """States on an arc over the level, with the sliders at their positions at rest."""
    w = point.box.nominal
    start = make_initial_sliders(point.balance, w)
    for x in find_motions_along_the_level(point.balance, point.condensed.angular_frequency, start):
        trial = point.solve(x, w, ANY_RATIO)
        if trial is not None:
            yield trial


def _select_furthest(states: Sequence[_EvaluatedState], number: int, side: LimitSide, count: int) -> list[SearchStart]:
    """The outermost states of different values for one objective."""
    result: list[_EvaluatedState] = []
    for state in sorted(states, key=lambda item: -side * float(item.value[number])):
        value = state.value[number]
        if all(abs(value - other.value[number]) > SAME_STATE * abs(other.value[number]) for other in result):
            result.append(state)
        if len(result) == count:
            break
    return [state.start for state in result]


def _find_ends(values: Real, n_objective: int) -> Float[Real, "2 o"]:
    return np.array([values.min(axis=0), values.max(axis=0)]) if len(values) else np.full((2, n_objective), np.nan)
