"""Tasks of a search for limits, which any executor may run and any store may keep."""

from collections.abc import Callable, MutableMapping, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from typing import Any

from hbsolve.limits.problem import LimitProblem


@dataclass(frozen=True, kw_only=True)
class StageProgress:
    """How far a search is.

    Parameters
    ----------
    stage
        What is being done, in words.
    done, of
        Tasks of this stage.
    """

    stage: str
    done: int
    of: int


@dataclass(frozen=True, kw_only=True, eq=False)
class SearchTask:
    """One call that a store may already hold the result of."""

    key: str
    call: Callable[..., Any]
    arguments: tuple[Any, ...]


#: The problem of the tasks that this process has run: its condensed structures serve all of them.
_kept: dict[str, LimitProblem] = {}


def run_task(token: str, problem: LimitProblem, call: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Run a task in any process."""
    if token not in _kept:
        _kept.clear()
        _kept[token] = problem
    return call(_kept[token], *arguments)


@dataclass(frozen=True, kw_only=True, eq=False)
class Runner:
    """Runs tasks: those that the store holds are not run again.

    Parameters
    ----------
    problem
        First argument of every call.
    token
        A name that no other problem has.
    store
        Receives each result when it is there.
    executor
        Runs them; this process by default.
    progress
        Called after each task.
    """

    problem: LimitProblem
    token: str
    store: MutableMapping[str, Any]
    executor: Executor | None
    progress: Callable[[StageProgress], None]

    def __call__(self, stage: str, tasks: Sequence[SearchTask]) -> list[Any]:
        """Results of the tasks of one stage, in order."""
        missing = [task for task in tasks if task.key not in self.store]
        done = len(tasks) - len(missing)
        self.progress(StageProgress(stage=stage, done=done, of=len(tasks)))
        if self.executor is None:
            for task in missing:
                self.store[task.key] = run_task(self.token, self.problem, task.call, task.arguments)
                done += 1
                self.progress(StageProgress(stage=stage, done=done, of=len(tasks)))
        else:
            sent = {
                self.executor.submit(run_task, self.token, self.problem, task.call, task.arguments): task
                for task in missing
            }
            for future in as_completed(sent):
                self.store[sent[future].key] = future.result()
                done += 1
                self.progress(StageProgress(stage=stage, done=done, of=len(tasks)))
        return [self.store[task.key] for task in tasks]
