"""Runs the campaigns of the hidden-effect test in worker processes and continues interrupted runs."""

import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from itertools import islice
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait as wait_for
from pathlib import Path

from benchmarks.hidden_effects_plan import Case
from benchmarks.hidden_effects_record import FAILED, Record, append, read

#: On two cores, two processes with two threads each are slower than with one thread each.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
#: Number of campaigns after which a process is replaced; largest number of crashes of processes in a run.
FRESH_AFTER, MOST_DEATHS = 40, 3

#: Function that makes the record of a case, with a folder for temporary files; at the top level of a module.
Work = Callable[[Case, Path], Record]


def run(
    cases: Sequence[Case],
    folder: Path,
    work: Work,
    *,
    workers: int,
    most_seconds: float = float("inf"),
    again: bool = False,
    say: Callable[[str], None] = print,
    told: Callable[[Record], str] = str,
) -> list[Record]:
    """Make the missing records of the cases.

    Parameters
    ----------
    cases
        Cases in the order in which they are run.
    folder
        Folder of `records.jsonl`, to which each record is appended as soon as it is made.
    work
        Function that makes a record.
    workers
        Number of processes; 0 runs in this one.
    most_seconds
        Time after which no campaign is begun [s].
    again
        Whether failed campaigns are run again.
    say, told
        Function for lines of progress, and function that describes a record in them.

    Returns
    -------
    Records of the cases that have been run.
    """
    folder.mkdir(parents=True, exist_ok=True)
    file, deadline = folder / "records.jsonl", time.monotonic() + most_seconds
    known = {(record.row, record.seed): record for record in read(file)}
    done = {key for key, record in known.items() if not (again and record.finding == FAILED)}
    todo = [case for case in cases if (case.row, case.seed) not in done]
    say(f"{len(cases) - len(todo)} of {len(cases)} campaigns are there, {len(todo)} to make ({file})")
    started, n_made, deaths = time.monotonic(), 0, 0
    while todo and time.monotonic() < deadline:
        try:
            # An exception closes the generator, which stops the processes.
            with closing(_made([*todo], folder, work, workers, deadline)) as made:
                for record in made:
                    append(file, record)
                    known[record.row, record.seed] = record
                    todo.remove(Case(row=record.row, seed=record.seed))
                    n_made += 1
                    left = (time.monotonic() - started) / n_made * len(todo)
                    say(f"{len(cases) - len(todo)}/{len(cases)}  {told(record)}; {_spoken(left)} left")
        except BrokenProcessPool:
            deaths += 1
            say("a process died, most often for lack of memory; what was finished is kept")
            if deaths > MOST_DEATHS:
                raise
    if todo:
        say(f"{len(todo)} campaigns are left: run it again to go on")
    wanted = {(case.row, case.seed) for case in cases}
    return [record for key, record in known.items() if key in wanted]


def _made(
    cases: Sequence[Case], folder: Path, work: Work, workers: int, deadline: float
) -> Generator[Record, None, None]:
    """Records in the order of completion."""
    if not workers:
        for case in cases:
            if time.monotonic() < deadline:
                yield work(case, folder)
        return
    os.environ.update(ONE_THREAD)
    # Spawned processes do not inherit locks and threads of this process.
    pool = ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=_begin, max_tasks_per_child=FRESH_AFTER
    )
    running: set[Future[Record]] = set()
    waiting = iter(cases)
    try:
        while True:
            if time.monotonic() < deadline:
                running |= {pool.submit(work, case, folder) for case in islice(waiting, workers - len(running))}
            if not running:
                return
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                yield future.result()
    finally:
        # After Ctrl-C, running campaigns are lost, so the processes are killed at once.
        for process in [*(pool._processes or {}).values()] if running else ():
            process.kill()
        pool.shutdown(wait=True, cancel_futures=True)


def _begin() -> None:
    """Ignore Ctrl-C, which the parent process handles, and exit when the parent has ended, even if it was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        wait_for([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _spoken(seconds: float) -> str:
    minutes = round(seconds / 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"
