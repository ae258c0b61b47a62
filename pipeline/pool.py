"""Many short stages side by side in a pool of processes, each result stored as soon as it is there.

`pipeline.parallel.run_parallel` gives each stage a process of its own. A pool spares short stages its start, and tasks
are made one after the other, so that those of a large grid need not be in memory together.
"""

import importlib
import os
from collections.abc import Iterable, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from geometry.errors import ComputationFailed
from geometry.registry import load_file, loaded_files
from pipeline.parallel import NO_GUARD, Task, process_pool
from pipeline.progress import Progress, Report
from pipeline.store import Store

#: How often the time left is shown while nothing ends [s].
LOOK_EVERY = 1.0
#: Tasks that wait for a process, per process: it begins the next one at once.
WAITING = 2


def run_pooled(
    tasks: Iterable[Task], count: int, store: Store, progress: Progress, title: str, workers: int | None = None
) -> list[Any]:
    """Results of all tasks, in their order; what is in the store is not computed again.

    Parameters
    ----------
    tasks
        Tasks; each is asked for when a process is nearly free.
    count
        Their number [-].
    store
        Store of the results.
    progress, title
        Shows the share of the tasks that is computed, and the time left of those that were not stored.
    workers
        Processes [-]; one for each core by default. With 1 the tasks run in this process.

    Raises
    ------
    ComputationFailed
        A process was killed, most often for lack of memory.
    InputError
        Errors of the stages.
    """
    with progress.step(title) as report:
        try:
            return _run(tasks, count, store, report, workers or os.cpu_count() or 1)
        except BrokenExecutor as error:
            raise ComputationFailed(
                "a process was killed, most often for lack of memory: close other programs; what was finished is "
                f"stored, and the same command goes on from there. Or it {NO_GUARD}"
            ) from error


def _run(tasks: Iterable[Task], count: int, store: Store, report: Report, n_worker: int) -> list[Any]:
    results: dict[int, Any] = {}
    running: dict[Future[Any], int] = {}
    executor: Executor | None = None
    n_stored = 0
    with ExitStack() as closed_in_the_end:
        for number, task in enumerate(tasks):
            known = store.look_up(task.stage, **task.inputs)
            if known is not None:
                results[number] = known.value
                n_stored += 1
            elif n_worker == 1:
                results[number] = store.run(task.stage, **task.inputs)
            else:
                if executor is None:
                    pool = process_pool([task.stage.compute.__module__], n_worker)
                    executor = closed_in_the_end.enter_context(pool)
                running[_submit(executor, task, store)] = number
            while len(running) >= WAITING * n_worker:
                _collect(running, results)
                _report(report, len(results) - n_stored, count - n_stored)
            _report(report, len(results) - n_stored, count - n_stored)
        while running:
            _collect(running, results)
            _report(report, len(results) - n_stored, count - n_stored)
    return [results[number] for number in range(len(results))]


def _report(report: Report, done: int, total: int) -> None:
    if done:
        report(done, total)


def _submit(executor: Executor, task: Task, store: Store) -> Future[Any]:
    stage = task.stage.compute
    inputs: Mapping[str, Any] = task.inputs
    return executor.submit(_compute, stage.__module__, stage.__name__, store.folder, loaded_files(), inputs)


def _collect(running: dict[Future[Any], int], results: dict[int, Any]) -> None:
    """Wait until something ends, or for a moment."""
    done, _ = wait(running, timeout=LOOK_EVERY, return_when=FIRST_COMPLETED)
    for future in done:
        results[running.pop(future)] = future.result()


def _compute(module: str, name: str, folder: Path | None, plugins: list[Path], inputs: Mapping[str, Any]) -> Any:
    """In a process of the pool: a stage is known by its name, since it cannot be pickled itself."""
    for plugin in set(plugins) - set(loaded_files()):
        load_file(plugin)
    stage = getattr(importlib.import_module(module), name)
    return Store(folder).run(stage, **inputs)
