"""Random friction histories: steady states after sweeps, overshoots and restarts.

Each history keeps its sliders along the frequencies, up or down, as in a test; at random it restarts, or the level
overshoots and returns. Its states lie inside the limits, since they are not chosen to be extreme.

Agreement of searches is no proof: for a small damper all seeds found the same wrong optimum. So an audit counts the
states outside a limit, and then repairs the limit from them.
"""

from collections.abc import Callable, Iterator, MutableMapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from fe.blas_threads import on_one_blas_thread
from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.optimum import LimitKey, Optima, improve
from hbsolve.limits.point import LimitPoint, Sliders, TrialState
from hbsolve.limits.problem import LimitCurve, LimitProblem
from hbsolve.limits.result import ResponseLimits
from hbsolve.limits.slider_bounds import N_KIND, make_random_sliders
from hbsolve.limits.task import Runner, SearchTask, StageProgress
from reduction.array_type import Real

#: Probability of an event in a history between two frequencies; one in four is an overshoot, to a level in this range
#: relative to that of the curve.
EVENT, OVERSHOOT = 0.1, (1.2, 2.2)
#: Relative excess over a limit above which a state counts as outside, and above which the limit is repaired.
OUTSIDE, REPAIR = 1e-3, 1e-5
#: Number of frequencies by which sweeps extend beyond a block: a branch is reached from earlier frequencies.
RUN_IN = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledStates:
    """States of n histories at some frequencies of one level."""

    value: Float[Real, "f n"]
    """Value of the objective, NaN where no state was found, shape (f, n)."""
    extreme: dict[tuple[int, LimitSide], tuple[Real, Real]]
    """Outermost state at each frequency and side, as motion and sliders."""


@on_one_blas_thread
def sampled_states(curve: LimitCurve, indices: Sequence[int], count: int, seed: Sequence[int]) -> SampledStates:
    """Sample random histories at the frequencies of `indices`, half of them swept up and half down."""
    box = curve.box
    value = np.full((len(indices), count), np.nan)
    extreme: dict[tuple[int, LimitSide], TrialState] = {}
    for row, number, trial in random_states(curve, indices, count, seed):
        value[row, number] = trial.value
        for side in LimitSide:
            key = indices[row], side
            if key not in extreme or side * (trial.value - extreme[key].value) > 0:
                extreme[key] = trial
    return SampledStates(
        value=value, extreme={key: (trial.motion, box.clip(trial.periodic_slider)) for key, trial in extreme.items()}
    )


def random_states(
    curve: LimitCurve, indices: Sequence[int], count: int, seed: Sequence[int]
) -> Iterator[tuple[int, int, TrialState]]:
    """States of random histories as they are found: position in `indices`, number of the history, state."""
    table, box, random = curve.problem.sliders, curve.box, np.random.default_rng(seed)
    for way in (0, 1):
        carried: dict[int, TrialState] = {}
        waiting = {number: make_random_sliders(table, box, random, number) for number in range(count)}
        order = range(len(indices)) if way == 0 else range(len(indices) - 1, -1, -1)
        for row in order:
            point = curve.point(indices[row])
            over = replace(curve, level=curve.level * random.uniform(*OVERSHOOT)).point(indices[row])
            last: TrialState | None = None
            for number in range(way, count, 2):
                trial = _solve_next(point, over, carried.get(number), waiting[number], last, random)
                if trial is None:
                    carried.pop(number, None)
                    continue
                waiting[number] = box.clip(trial.periodic_slider)
                carried[number] = last = trial
                yield row, number, trial


def _solve_next(
    point: LimitPoint, over: LimitPoint, before: TrialState | None, w: Sliders, last: TrialState | None,
    random: np.random.Generator,
) -> TrialState | None:  # fmt: skip
    """The state of one history at its next frequency."""
    trial = None if before is None else point.solve(before.motion, w)
    if before is not None and random.random() < EVENT:
        kind = int(random.integers(N_KIND))
        known = trial or last
        if kind >= 6 and trial is not None:
            passed = over.solve(trial.motion, w)
            if passed is not None:
                trial = point.solve(trial.motion, point.box.clip(passed.periodic_slider)) or trial
        elif kind < 6 and known is not None:
            trial = point.towards(make_random_sliders(point.sliders, point.box, random, kind), known) or trial
    if trial is not None:
        return trial
    return point.towards(w, last) if last is not None else point.from_rest(w) or point.from_anywhere(w)


@dataclass(frozen=True, kw_only=True)
class Audit:
    """Sampled states at one frequency and level."""

    count: int
    """Number of sampled states [-]."""
    lowest: float
    highest: float
    """Lowest and highest value of these states."""
    below: int
    above: int
    """Number of states outside the limits by more than `OUTSIDE`, before any repair [-]."""


def audit(
    curve: LimitCurve, indices: Sequence[int], best: Optima, count: int, seed: Sequence[int]
) -> tuple[Optima, set[LimitKey], dict[int, Audit]]:
    """Sample histories at a level; returns the optima, the keys of those repaired, and the audits before repair."""
    best, repaired = dict(best), set()
    swept = range(max(indices[0] - RUN_IN, 0), min(indices[-1] + RUN_IN + 1, len(curve.angular_frequency)))
    sampled = sampled_states(curve, swept, count, seed)
    audits = {}
    for row, index in enumerate(swept):
        if index not in indices:
            continue
        values = sampled.value[row][np.isfinite(sampled.value[row])]
        point = curve.point(index)
        outside = {}
        for side in LimitSide:
            limit = best.get((index, side))
            excess = [side * point.gain(value, limit.value) for value in values] if limit else [np.inf] * len(values)
            outside[side] = int((np.array(excess) > OUTSIDE).sum())
            if not len(values) or max(excess) <= REPAIR:
                continue
            if improve(point, best, (index, side), *sampled.extreme[index, side], repaired=True) > 0:
                repaired.add((index, side))
        audits[index] = Audit(
            count=len(values),
            lowest=float(values.min(initial=np.inf)),
            highest=float(values.max(initial=-np.inf)),
            below=outside[LimitSide.LOWER],
            above=outside[LimitSide.UPPER],
        )
    return best, repaired, audits


@dataclass(frozen=True, kw_only=True, eq=False)
class IndependentHistories:
    """Random histories compared with limits."""

    value: Float[Real, "l f n"]
    """Value of the objective, NaN where no state was found, shape (l, f, n)."""
    excess: Float[Real, "l f n"]
    """Excess of each state over the nearer limit, relative to it; negative inside, shape (l, f, n) [-]."""

    def share_outside(self, by: float) -> float:
        """Fraction of the states outside by more than the fraction `by` of the limit [-]."""
        answer = self.excess[np.isfinite(self.excess)]
        return float((answer > by).mean()) if answer.size else 0.0


def independent_histories(
    problem: LimitProblem,
    limits: ResponseLimits,
    count: int,
    *,
    seed: int,
    store: MutableMapping[str, Any] | None = None,
    executor: Executor | None = None,
    progress: Callable[[StageProgress], None] | None = None,
) -> IndependentHistories:
    """Sample histories in the same box, swept over the frequencies of the limits.

    Parameters
    ----------
    problem, limits
        Argument and result of `hbsolve.limits.response_limits.response_limits`.
    count
        Number of histories [-].
    seed
        Seed, different from that of the search.
    store, executor, progress
        As in `response_limits`; one task per level.
    """
    run = Runner.from_problem(problem, limits.angular_frequency, store, executor, progress)
    indices = range(len(limits.angular_frequency))
    tasks = [
        SearchTask(
            f"independent histories, level {number}", sampled_states, float(level), (indices, count, (seed, number, 3))
        )
        for number, level in enumerate(limits.level)
    ]
    value = np.array([states.value for states in run("independent histories", tasks)])
    size = np.abs(limits.value)[..., None]
    excess = np.maximum((value - limits.upper[..., None]) / size[1], (limits.lower[..., None] - value) / size[0])
    return IndependentHistories(value=value, excess=excess)
