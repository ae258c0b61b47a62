"""Limits of several objectives of one system in one search: its steady states are sampled once for all of them."""

from collections.abc import Callable, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

from fe.blas_threads import on_one_blas_thread
from hbsolve.errors import BalanceError
from hbsolve.limits.auxiliary_frequencies import add_auxiliary_frequencies
from hbsolve.limits.objective import Objective
from hbsolve.limits.optimum import LimitKey
from hbsolve.limits.point import SearchStart
from hbsolve.limits.problem import Frequencies, LimitProblem
from hbsolve.limits.random_histories import Audit
from hbsolve.limits.response_limits import check_ascending, collect_limits, make_starts_by_level
from hbsolve.limits.result import ResponseLimits
from hbsolve.limits.search import LimitSettings, StagedSearch
from hbsolve.limits.shared_histories import SharedStates, share_histories
from hbsolve.limits.task import Runner, SearchTask, StageProgress, make_task_key, split_frequencies
from reduction.array_type import Real

#: Work of a shared history relative to the local searches of one objective, measured on a beam with six contacts.
WORK_PER_HISTORY = 0.012


@dataclass(frozen=True, kw_only=True)
class SeveralProgress:
    """Progress of a search for several limits."""

    stage: StageProgress
    """Present stage."""
    before: float
    """Work of the finished objectives and shared states [-]."""
    shared: float
    total: float
    """Work of the shared states, and of the whole search; that of one objective is 1 [-]."""


@on_one_blas_thread
def several_limits(
    problem: LimitProblem,
    objectives: Mapping[str, Objective],
    angular_frequency: Sequence[float] | Frequencies,
    levels: Sequence[float] | Real,
    *,
    settings: LimitSettings | None = None,
    store: MutableMapping[str, Any] | None = None,
    executor: Executor | None = None,
    progress: Callable[[SeveralProgress], None] | None = None,
) -> dict[str, ResponseLimits]:
    """Largest and smallest value of each objective over all slider states of the box, at each frequency and level.

    As `response_limits` for each objective, but with a common population and common random histories; no sampled state
    is outside the limits, since the searches begin at the outermost states.

    Parameters
    ----------
    problem
        System and box; its own objective is not used.
    objectives
        Objectives by name.
    angular_frequency, levels
        Omega and levels, ascending, shapes (f,) [rad/s] and (l,) [-].
    settings
        Effort of the search.
    store
        Mapping that keeps the result of each task by name; it is valid only for the same arguments, except the
        executor.
    executor
        Executor of the tasks; this process by default.
    progress
        Called after each task.

    Raises
    ------
    BalanceError
        Frequencies or levels that are not positive and ascending, no objective, or an objective that the system does
        not have.
    """
    if not objectives:
        raise BalanceError("there is no objective: give at least one")
    chosen = settings or LimitSettings()
    omega, scale = check_ascending(angular_frequency, "angular_frequency"), check_ascending(levels, "levels")
    searched = add_auxiliary_frequencies(problem.balance, omega, chosen.frequencies)
    problems = {name: replace(problem, objective=item) for name, item in objectives.items()}
    shared_work = WORK_PER_HISTORY * (2 * chosen.population + chosen.sample)
    total = shared_work + len(problems)

    def runner(single: LimitProblem, before: float, prefix: str) -> Runner:
        def report(stage: StageProgress) -> None:
            if progress is not None:
                progress(SeveralProgress(stage=stage, before=before, shared=shared_work, total=total))

        return replace(Runner.from_problem(single, searched.angular_frequency, store, executor, report), prefix=prefix)

    first = next(iter(problems.values()))
    shared = _sample_shared(runner(first, 0.0, ""), [*objectives.values()], scale, chosen)
    result = {}
    for number, (name, single) in enumerate(problems.items()):
        run = runner(single, shared_work + number, f"{name}: ")
        search = StagedSearch(run=run, levels=scale.tolist(), starts=(), settings=chosen)
        best, certificates = search.limits_from([_list_starts(parts, number) for parts in shared])
        audits = [_list_audits(parts, number) for parts in shared]
        result[name] = collect_limits(single, searched, scale, best, audits, certificates)
    return result


def _sample_shared(
    run: Runner, objectives: Sequence[Objective], levels: Real, settings: LimitSettings
) -> list[list[SharedStates]]:
    """Sampled states of each level, block by block."""
    problem, omega = run.problem, run.angular_frequency
    population = make_starts_by_level(problem, omega, levels, settings)
    blocks = split_frequencies(len(omega), settings.block)
    tasks = [
        SearchTask(
            key=make_task_key("shared", number, block),
            call=share_histories,
            level=float(level),
            arguments=(block, objectives, population[number], settings.sample, (settings.seed, number, block.start, 2)),
        )
        for number, level in reversed([*enumerate(levels)])
        for block in blocks
    ]
    results = iter(run("shared histories", tasks))
    return [[next(results) for _ in blocks] for _ in levels][::-1]


def _list_starts(parts: Sequence[SharedStates], number: int) -> dict[LimitKey, Sequence[SearchStart]]:
    """Starts of one objective at one level."""
    return {key: states for part in parts for key, states in part.starts[number].items()}


def _list_audits(parts: Sequence[SharedStates], number: int) -> dict[int, Audit]:
    """Sampled states of one objective at one level, by frequency."""
    result = {}
    for part in parts:
        for index, ends in part.sampled.items():
            lowest, highest = ends[:, number].tolist()
            result[index] = Audit(count=part.count[index], lowest=lowest, highest=highest, below=0, above=0)
    return result
