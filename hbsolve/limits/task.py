"""Tasks of a search for limits, for any executor and any store."""

from collections.abc import Callable, Iterator, MutableMapping, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple
from uuid import uuid4

from hbsolve.limits.problem import Frequencies, LimitCurve, LimitProblem


@dataclass(frozen=True, kw_only=True)
class StageProgress:
    """Progress of a search."""

    stage: str
    """Description of the present stage."""
    done: int
    total: int
    """Number of tasks of this stage, finished and in total."""


class SearchTask(NamedTuple):
    """One call at one level, whose result may already be stored."""

    key: str
    call: Callable[..., Any]
    level: float
    arguments: tuple[Any, ...]


def split_frequencies(count: int, size: int) -> list[range]:
    """Indices of the frequencies of each block."""
    return [range(first, last) for first, last in pairwise([*range(0, count, size), count])]


def make_task_key(name: str, level: int, block: range) -> str:
    """Name of a task in a store."""
    return f"{name}; level {level}, frequencies {block.start} to {block.stop - 1}"


#: Problem of the tasks of this process by token: all tasks share its condensed structures.
_stored: dict[str, LimitProblem] = {}


def run_task(token: str, problem: LimitProblem, angular_frequency: Frequencies, task: SearchTask) -> Any:
    """Run a task in any process."""
    if token not in _stored:
        _stored.clear()
        _stored[token] = problem
    curve = LimitCurve(problem=_stored[token], level=task.level, angular_frequency=angular_frequency)
    return task.call(curve, *task.arguments)


@dataclass(frozen=True, kw_only=True, eq=False)
class Runner:
    """Runs tasks whose results are not stored yet."""

    problem: LimitProblem
    angular_frequency: Frequencies
    """Problem and frequencies of all tasks."""
    token: str
    """Unique name of the problem."""
    store: MutableMapping[str, Any]
    """Mapping that receives each result at once."""
    executor: Executor | None
    """Executor of the tasks; None for this process."""
    progress: Callable[[StageProgress], None]
    """Function called after each task."""
    prefix: str = ""
    """Prefix of the names of the tasks in the store."""

    @classmethod
    def from_problem(
        cls, problem: LimitProblem, angular_frequency: Frequencies, store: MutableMapping[str, Any] | None,
        executor: Executor | None, progress: Callable[[StageProgress], None] | None,
    ) -> "Runner":  # fmt: skip
        """Make a runner; without a store, results are kept as long as the runner."""
        return cls(
            problem=problem, angular_frequency=angular_frequency, token=uuid4().hex,
            store={} if store is None else store, executor=executor, progress=progress or (lambda _: None),
        )  # fmt: skip

    def __call__(self, stage: str, tasks: Sequence[SearchTask]) -> list[Any]:
        """Results of the tasks of one stage, in order."""
        tasks = [task._replace(key=f"{self.prefix}{task.key}") for task in tasks]
        missing = [task for task in tasks if task.key not in self.store]
        done = len(tasks) - len(missing)
        self.progress(StageProgress(stage=stage, done=done, total=len(tasks)))
        for key, result in self._results(missing):
            self.store[key] = result
            done += 1
            self.progress(StageProgress(stage=stage, done=done, total=len(tasks)))
        return [self.store[task.key] for task in tasks]

    def _results(self, tasks: Sequence[SearchTask]) -> Iterator[tuple[str, Any]]:
        """Keys and results of tasks in the order of completion."""
        given = self.token, self.problem, self.angular_frequency
        if self.executor is None:
            yield from ((task.key, run_task(*given, task)) for task in tasks)
        else:
            sent = {self.executor.submit(run_task, *given, task): task.key for task in tasks}
            yield from ((sent[future], future.result()) for future in as_completed(sent))
