"""A search for limits whose finished tasks are stored beside the results, so that a search that was stopped goes on."""

from concurrent.futures import Executor
from contextlib import nullcontext
from typing import TypeVar

from pipeline.checkpoint import StoredTasks
from pipeline.store import Stage
from pipeline.worker_pool import worker_pool
from study.run_context import RunContext

Found = TypeVar("Found")


def run_search(
    searched: Stage[..., Found], search: object, stem: str, run: RunContext, executor: Executor | None
) -> Found:
    """From the store, or searched for, each task stored beside the results until all are there.

    Parameters
    ----------
    searched
        Stage that takes the search, and its tasks, executor and progress.
    search
        What is searched for.
    stem
        Stem of the folder of finished tasks.
    run
        Output folder, store and progress of the run.
    executor
        Runs the tasks; by default the scheduler of the run, or a process for each core.

    Raises
    ------
    ComputationFailed
        No rest under the static load, or a process that was killed.
    InputError
        No scheduler that can be used answers at the address.
    """
    assert run.output is not None
    known = run.store.look_up(searched, search)
    if known is not None:
        return known.value
    tasks = StoredTasks(run.output / f".{stem}_limits.part", searched.key(search), run.warn)
    before = tasks.n_left
    if before:
        run.note(
            f"the search continues: {before} of its tasks were already finished; the progress shown is that of the "
            "others"
        )
    pool = nullcontext(executor) if executor is not None else worker_pool([searched.compute.__module__], run.scheduler)
    with run.progress.step("limits") as report, pool as processes:
        result = run.store.run(searched, search, tasks=tasks, executor=processes, report=report)
    tasks.remove()
    return result
