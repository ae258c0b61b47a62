"""A process pool whose processes end with the one that started them, however that ends."""

import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection

from pipeline.parallel import CONTEXT, single_threaded


@contextmanager
def process_pool(modules: Sequence[str], workers: int | None = None) -> Iterator[Executor]:
    """Processes for tasks of one kind; at an early end, Ctrl-C included, what they do is thrown away at once.

    Parameters
    ----------
    modules
        What the tasks need, imported once for all processes.
    workers
        Processes [-]; by default one for each core.
    """
    CONTEXT.set_forkserver_preload(list(modules))
    # Nothing is ever sent: the processes see the end of file when this one closes its end, or is killed.
    alive, held = CONTEXT.Pipe(duplex=False)
    with single_threaded():
        pool = ProcessPoolExecutor(
            workers or os.cpu_count() or 1, mp_context=CONTEXT, initializer=_begin, initargs=(alive,)
        )
        try:
            yield pool
        finally:
            held.close()
            pool.shutdown(cancel_futures=True)
            alive.close()


def _begin(alive: Connection) -> None:
    """Leave Ctrl-C, which a terminal sends to all, to the process that waits for the results, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(alive,), daemon=True).start()


def _end_with(alive: Connection) -> None:
    alive.poll(None)
    os._exit(1)
