"""Parallel work in separate processes, which end with the process that started them.

Stages (`run_parallel`) have a process each, so that their peak memory is separate, and Ctrl-C loses only running ones.
Tasks of one kind share the processes of a pool (`process_pool`).
"""

import contextlib
import importlib
import multiprocessing
import os
import pickle
import signal
import tempfile
import threading
import traceback
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from concurrent.futures import wait as wait_for_all
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerContext, SpawnContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from geometry.errors import ComputationFailed, InputError
from geometry.registry import load_file, loaded_files
from pipeline.blas_threads import ONE_THREAD
from pipeline.progress import Progress
from pipeline.store import Outcome, Stage, Store

#: A fresh process for each task: the peak memory that it reports is that of the task alone. Where it exists, a small
#: server that has imported what the stages need forks them, which saves each of them seconds.
CONTEXT: ForkServerContext | SpawnContext = (
    multiprocessing.get_context("forkserver")
    if "forkserver" in multiprocessing.get_all_start_methods()
    else multiprocessing.get_context("spawn")
)
#: Interval at which progress is shown while no task ends [s].
LOOK_EVERY = 1.0
#: Why a process ends before it begins: it imports the script anew, which starts processes of its own.
NO_GUARD = 'did not start: a script that uses several processes must do its work below `if __name__ == "__main__":`'


@dataclass(frozen=True, kw_only=True, eq=False)
class Task:
    """One stage to run.

    Parameters
    ----------
    stage
        A stage at the top level of its module.
    inputs
        Its arguments by name.
    label
        Shown to the user.
    weight
        Amount of work relative to the other tasks [-]; the largest start first.
    memory
        Approximate memory of its process [byte].
    """

    stage: Stage[Any, Any]
    inputs: Mapping[str, Any]
    label: str
    weight: float = 1.0
    memory: float = 0.0


def run_parallel(
    tasks: Sequence[Task],
    store: Store,
    progress: Progress,
    title: str,
    workers: int | None = None,
    memory: float = float("inf"),
) -> list[Outcome[Any]]:
    """Results of all tasks, in their order; stored results are not computed again.

    Parameters
    ----------
    tasks
        Stages with their inputs.
    store
        Store of the results; each is stored as soon as it is computed.
    progress, title
        Shows the finished share of the weight.
    workers
        Processes [-]; by default one for each core.
    memory
        Largest total memory of simultaneous tasks [byte].

    Raises
    ------
    ComputationFailed
        A process was killed, most often for lack of memory, or cannot begin in a script without a guard.
    InputError
        Errors of the stages.
    """
    total = sum(task.weight for task in tasks)
    stored = (store.look_up(task.stage, **task.inputs) for task in tasks)
    outcomes: dict[int, Outcome[Any]] = {
        number: outcome for number, outcome in enumerate(stored) if outcome is not None
    }
    missing = sorted(set(range(len(tasks))) - set(outcomes), key=lambda number: -tasks[number].weight)
    if not missing:
        progress.stored(title)
        return [outcomes[number] for number in range(len(tasks))]
    with progress.step(title) as report:
        n_worker = workers or count_default_workers()
        modules = sorted({_name_stage(tasks[number].stage)[0] for number in missing})
        with _with_folder(store) as results, single_threaded(), _workers(modules) as workers_by_task:
            while missing or workers_by_task:
                for number in _admit_tasks(tasks, missing, list(workers_by_task), n_worker, memory):
                    missing.remove(number)
                    _start(workers_by_task, number, tasks[number], results.folder)
                wait([worker.process.sentinel for worker in workers_by_task.values()], timeout=LOOK_EVERY)
                for number in [n for n, worker in workers_by_task.items() if worker.process.exitcode is not None]:
                    outcomes[number] = _take_result(workers_by_task.pop(number), tasks[number], results)
                report(sum(tasks[n].weight for n in outcomes), total)
    return [outcomes[number] for number in range(len(tasks))]


def _admit_tasks(
    tasks: Sequence[Task], missing: Sequence[int], running: Sequence[int], n_worker: int, memory: float
) -> list[int]:
    """Tasks to start now: the largest first, within the limits of processes and memory; at least one runs."""
    taken = sum(tasks[number].memory for number in running)
    admitted: list[int] = []
    for number in missing:
        if len(running) + len(admitted) == n_worker:
            break
        if taken + tasks[number].memory <= memory or not (running or admitted):
            admitted.append(number)
            taken += tasks[number].memory
    return admitted


@contextmanager
def _with_folder(store: Store) -> Iterator[Store]:
    """A store with a folder, through which the processes return their results."""
    if store.folder is not None:
        yield store
    else:
        with tempfile.TemporaryDirectory(prefix="stickslip-") as folder:
            yield Store(Path(folder))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Worker:
    """A process that runs one task, and the connection for its errors."""

    process: BaseProcess
    failure: Connection


@contextmanager
def _workers(modules: list[str]) -> Iterator[dict[int, _Worker]]:
    """Workers by number of task, initially none; at an early end running ones are killed, with their programs."""
    CONTEXT.set_forkserver_preload(modules)
    # It would unblock Ctrl-C if it were started within `_start`.
    resource_tracker.ensure_running()
    running: dict[int, _Worker] = {}
    try:
        yield running
    finally:
        for worker in running.values():  # on Ctrl-C nobody waits for work that is thrown away
            with contextlib.suppress(ProcessLookupError):
                worker.process.kill()
                os.killpg(worker.process.pid or 0, signal.SIGKILL)
        for worker in running.values():
            worker.process.join()


def _start(running: dict[int, _Worker], number: int, task: Task, folder: Path | None) -> None:
    receiver, sender = CONTEXT.Pipe(duplex=False)
    arguments = (sender, *_name_stage(task.stage), folder, loaded_files(), task.inputs)
    process = CONTEXT.Process(target=_compute, args=arguments, daemon=True)
    # Ctrl-C waits until the process is known to those who would kill it, and the process, which inherits this, never
    # sees the Ctrl-C that a terminal sends to all: it would only print where it was.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        process.start()
        running[number] = _Worker(process=process, failure=receiver)
    finally:
        sender.close()
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def single_threaded() -> Iterator[None]:
    """Processes that start within have one BLAS thread each: two with two each are slower on two cores."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _name_stage(stage: Stage[Any, Any]) -> tuple[str, str]:
    """Module and name of a stage: it cannot be pickled itself, as its name refers to the stage, not to the function."""
    return stage.compute.__module__, stage.compute.__name__


def _compute(
    failure: Connection, module: str, name: str, folder: Path | None, plugins: list[Path], inputs: Mapping[str, Any]
) -> None:
    os.setpgrp()  # so that a program which the stage runs can be killed with it
    try:
        for plugin in plugins:
            load_file(plugin)
        stage: Stage[Any, Any] = getattr(importlib.import_module(module), name)
        Store(folder).outcome(stage, **inputs)
    except Exception as error:
        failure.send(make_portable_error(error))


def make_portable_error(error: Exception) -> Exception:
    """An error that can be sent to another process; call it where the error was caught."""
    if not isinstance(error, InputError):
        error.add_note(traceback.format_exc())  # where it was, which does not travel by itself
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # not every error can be pickled
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


def _take_result(worker: _Worker, task: Task, results: Store) -> Outcome[Any]:
    try:
        raise worker.failure.recv() if worker.failure.poll() else EOFError
    except EOFError:
        pass  # it had nothing to say
    finally:
        worker.failure.close()
    code = worker.process.exitcode or 0
    if code < 0:  # the number of a signal
        raise ComputationFailed(
            f"{task.label} was killed, most often for lack of memory: close other programs, or use fewer elements; "
            "finished work is stored"
        )
    if code > 0:
        raise ComputationFailed(f"the process of {task.label} {NO_GUARD}")
    outcome = results.look_up(task.stage, **task.inputs)
    if outcome is None:
        raise ComputationFailed(
            f"the result of {task.label} is not in {results.folder}: free some space, or name another folder with "
            "--cache; if stickslip itself was changed meanwhile, run it again"
        )
    return outcome


def count_default_workers() -> int:
    """Number of cores that this process may use, as assigned by taskset or a batch system [-]."""
    return len(os.sched_getaffinity(0))


@contextmanager
def process_pool(modules: Sequence[str], workers: int | None = None) -> Iterator[Executor]:
    """Processes for tasks of one kind; at an early end, including Ctrl-C, running tasks are discarded at once.

    Parameters
    ----------
    modules
        Modules that the tasks need, imported once for all processes.
    workers
        Processes [-]; by default one for each core.
    """
    CONTEXT.set_forkserver_preload(list(modules))
    # Nothing is ever sent: the processes see the end of file when this one closes its end, or is killed.
    alive, stays_open = CONTEXT.Pipe(duplex=False)
    # It would unblock Ctrl-C if it were started below.
    resource_tracker.ensure_running()
    n_worker = workers or count_default_workers()
    with single_threaded():
        pool = ProcessPoolExecutor(n_worker, mp_context=CONTEXT, initializer=_begin, initargs=(alive,))
        try:
            # Ctrl-C waits until all have begun, seconds of imports: before, they would print where they were.
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
            try:
                wait_for_all([pool.submit(_do_nothing) for _ in range(n_worker)])
            except (EOFError, ConnectionError, BrokenExecutor) as error:
                raise ComputationFailed(
                    "a process was killed before it started, most often for lack of memory: close other programs; "
                    "what was finished is stored, and the same command continues from there"
                ) from error
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
            yield pool
        finally:
            stays_open.close()
            pool.shutdown(cancel_futures=True)
            alive.close()


def _do_nothing() -> None:
    """Do nothing: a first task that starts a process."""


def _begin(alive: Connection) -> None:
    """Leave Ctrl-C, which a terminal sends to all, to the process that waits for the results, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with, args=(alive,), daemon=True).start()


def end_with(alive: Connection) -> None:
    """End this process when the other end of a pipe is closed, or its process is killed."""
    alive.poll(None)
    os._exit(1)
