"""Common interface to workers for many tasks of one kind: processes of this machine, or those of a dask scheduler."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager

from pipeline.parallel import count_default_workers, process_pool

#: Processes of this machine, one for each core by default; or the address of a dask scheduler.
Workers = int | str | None


@contextmanager
def worker_pool(modules: Sequence[str], workers: Workers = None) -> Iterator[Executor]:
    """Workers for tasks; at an early end, including Ctrl-C, running tasks are discarded at once.

    Parameters
    ----------
    modules
        Modules that the tasks need and their results depend on.
    workers
        Number of processes of this machine, one for each core by default; or the address of a dask scheduler.

    Raises
    ------
    ComputationFailed
        A process could not begin.
    InputError
        No usable scheduler at the address.
    """
    if isinstance(workers, str):
        from pipeline.scheduler import scheduler_pool

        with scheduler_pool(workers, modules) as executor:
            yield executor
    else:
        with process_pool(modules, workers) as executor:
            yield executor


def count_workers(executor: Executor, workers: Workers) -> int:
    """Number of tasks that an executor of `worker_pool` runs at once [-]."""
    if isinstance(workers, str):
        from pipeline.scheduler import SchedulerExecutor

        assert isinstance(executor, SchedulerExecutor)
        return executor.n_worker
    return workers or count_default_workers()
