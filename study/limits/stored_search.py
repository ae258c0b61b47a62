"""Search for limits with finished tasks stored in the output folder, so that an interrupted search can continue."""

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
    """Return a stored result, or run the search; finished tasks are stored in the output folder until the end.

    Parameters
    ----------
    searched
        Stage that runs the search, with its tasks, executor and progress.
    search
        Input of the stage.
    stem
        Stem of the folder of finished tasks.
    run
        Output folder, store and progress of the run.
    executor
        Executor of the tasks; by default the scheduler of the run, or a process for each core.

    Raises
    ------
    ComputationFailed
        There is no state of rest under the static load, or a process was killed.
    InputError
        No usable scheduler answers at the address.
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
