"""Workers that are no processes: such begin in seconds, which is longer than the work of most tests."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

from pipeline.worker_pool import Workers, worker_pool


class InThisProcess(Executor):
    """Does what it is given at once."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@contextmanager
def pool_in_this_process(modules: Sequence[str], workers: Workers = None) -> Iterator[Executor]:
    """`worker_pool` without processes; a dask scheduler is asked as ever."""
    if isinstance(workers, str):
        with worker_pool(modules, workers) as executor:
            yield executor
    else:
        yield InThisProcess()
