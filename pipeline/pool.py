"""Many short stages in parallel in a pool of processes, each result stored as soon as it is available.

`pipeline.parallel.run_parallel` starts a process for each stage. A pool saves this start for short stages, and tasks
are made one after the other, so that those of a large grid need not be in memory together.
"""

import importlib
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from geometry.errors import ComputationFailed
from geometry.registry import load_file, loaded_files
from pipeline.parallel import NO_GUARD, Task
from pipeline.progress import Progress, Report
from pipeline.store import Outcome, Store
from pipeline.worker_pool import Workers, count_workers, worker_pool

T = TypeVar("T")

#: Interval at which the time left is shown while no task ends [s].
LOOK_EVERY = 1.0
#: Waiting tasks per process, so that a process begins the next one at once.
WAITING = 2

#: Number and task of each running or waiting call.
Running = dict[Future[Outcome[Any]], tuple[int, Task]]


def run_pooled(
    tasks: Iterable[Task], count: int, store: Store, progress: Progress, title: str, workers: Workers = None
) -> list[Any]:
    """Results of all tasks, in their order; stored results are not computed again.

    Parameters
    ----------
    tasks
        Tasks; the next one is taken when a process is nearly free.
    count
        Their number [-].
    store
        Store of the results.
    progress, title
        Shows the share of computed tasks, and the time left for those not stored.
    workers
        Processes [-]; one for each core by default. With 1 the tasks run in this process. Or the address of a dask
        scheduler.

    Raises
    ------
    ComputationFailed
        A process was killed, most often for lack of memory.
    InputError
        Errors of the stages, or no usable scheduler at the address.
    """
    with progress.step(title) as report, _explained_failure():
        return _run(tasks, count, store, report, workers)


def make_map(executor: Executor) -> Callable[..., Iterator[Any]]:
    """`map` over the processes of an executor, which load the users' files that this process has loaded.

    Its results raise `ComputationFailed` if a process was killed.
    """

    def map_over(function: Callable[..., Any], *items: Iterable[Any]) -> Iterator[Any]:
        with _explained_failure():
            yield from executor.map(partial(_call, loaded_files(), function), *items)

    return map_over


def start_call(executor: Executor, function: Callable[..., T], *items: Any) -> Callable[[], T]:
    """Start a call in a process of an executor, which loads the users' files that this process has loaded.

    Returns
    -------
    Waits for the result; raises `ComputationFailed` if the process was killed, else the error of the call.
    """
    future = executor.submit(_call, loaded_files(), function, *items)

    def wait_for_result() -> T:
        with _explained_failure():
            result: T = future.result()
        return result

    return wait_for_result


def _call(plugins: list[Path], function: Callable[..., Any], *items: Any) -> Any:
    _load_plugins(plugins)
    return function(*items)


@contextmanager
def _explained_failure() -> Iterator[None]:
    try:
        yield
    except BrokenExecutor as error:
        raise ComputationFailed(
            "a process was killed, most often for lack of memory: close other programs; what was finished is "
            f"stored, and the same command continues from there. Or it {NO_GUARD}"
        ) from error


def _run(tasks: Iterable[Task], count: int, store: Store, report: Report, workers: Workers) -> list[Any]:
    results: dict[int, Any] = {}
    running: Running = {}
    executor: Executor | None = None
    n_stored = 0
    with ExitStack() as closed_in_the_end:
        closed_in_the_end.callback(_keep_finished, running, store)
        for number, task in enumerate(tasks):
            known = store.look_up(task.stage, **task.inputs)
            if known is not None:
                results[number] = known.value
                n_stored += 1
            elif workers == 1:
                results[number] = store.run(task.stage, **task.inputs)
            else:
                if executor is None:
                    pool = worker_pool([task.stage.compute.__module__], workers)
                    executor = closed_in_the_end.enter_context(pool)
                running[_submit(executor, task)] = number, task
            while executor is not None and len(running) >= WAITING * count_workers(executor, workers):
                _collect(running, results, store)
                _report(report, len(results) - n_stored, count - n_stored)
            _report(report, len(results) - n_stored, count - n_stored)
        while running:
            _collect(running, results, store)
            _report(report, len(results) - n_stored, count - n_stored)
    return [results[number] for number in range(len(results))]


def _report(report: Report, done: int, total: int) -> None:
    if done:
        report(done, total)


def _collect(running: Running, results: dict[int, Any], store: Store) -> None:
    """Wait until a call ends, or for a short time."""
    done, _ = wait(running, timeout=LOOK_EVERY, return_when=FIRST_COMPLETED)
    for future in done:
        outcome = future.result()
        number, task = running.pop(future)
        store.keep(outcome, task.stage, **task.inputs)
        results[number] = outcome.value


def _keep_finished(running: Running, store: Store) -> None:
    """At an early end, store the results that finished besides the failed task."""
    for future, (_, task) in running.items():
        if future.done() and not future.cancelled() and future.exception() is None:
            store.keep(future.result(), task.stage, **task.inputs)


def _submit(executor: Executor, task: Task) -> "Future[Outcome[Any]]":
    stage = task.stage.compute
    compute = partial(_compute, stage.__module__, stage.__name__, loaded_files())
    return executor.submit(compute, **task.inputs)


def _compute(module: str, name: str, plugins: list[Path], **inputs: Any) -> Outcome[Any]:
    """In a process of the pool: a stage is given by its name, since it cannot be pickled itself."""
    _load_plugins(plugins)
    stage = getattr(importlib.import_module(module), name)
    begin = time.perf_counter()
    value = stage(**inputs)
    return Outcome(value=value, seconds=time.perf_counter() - begin, cached=False)


def _load_plugins(plugins: list[Path]) -> None:
    for plugin in set(plugins) - set(loaded_files()):
        load_file(plugin)
