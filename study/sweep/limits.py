"""Response limits of a case at many values of its parameters, each search stored when it is done."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace

from casefile.table import located
from pipeline.progress import Report, SilentProgress
from pipeline.worker_pool import Workers, worker_pool
from study.case.setup import read_case
from study.kind.registry import OpenCase
from study.limits.curve import found_limits
from study.limits.model import make_limit_search
from study.limits.refinement import refine_to_tolerance
from study.limits.result import LimitCurves, convert_own_limits
from study.limits.stored_search import run_search
from study.run_context import RunContext
from study.solve.model import make_vibrating_model
from study.sweep.parameter import vary
from study.sweep.samples import Point


def asks_for_limits(opened: OpenCase) -> bool:
    """Whether a case has a table [limits]."""
    return opened.case.source is not None and "limits" in opened.case.source.data


def compute_limits(
    opened: OpenCase, points: Sequence[Point], stem: str, run: RunContext, workers: Workers = None
) -> tuple[LimitCurves, ...]:
    """Limits of all points; a search that is stored is not repeated, and one that was stopped goes on.

    Parameters
    ----------
    opened
        The case.
    points
        Values of the parameters.
    stem
        Stem of the folders of unfinished searches.
    run
        Output folder, store and progress of the run.
    workers
        Processes [-]; one for each core by default, this process for 1. Or the address of a dask scheduler.

    Raises
    ------
    CaseError
        A point that is no sound case.
    ComputationFailed
        No rest under the static load, or a process that was killed.
    """
    result: list[LimitCurves] = []
    with run.progress.step(f"limits at {len(points)} points") as report, ExitStack() as closed_in_the_end:
        executor: Executor | None = None
        n_stored = 0
        for number, point in enumerate(points):
            within = _Within(report, number - n_stored, len(points) - n_stored)
            own = replace(run, progress=within)
            varied = vary(opened, point)
            case = varied.case
            model = make_vibrating_model(read_case(varied, run=replace(run, progress=SilentProgress())))
            with located(case, "limits"):
                search = make_limit_search(case, case.limits, case.sweep, model)
            known = run.store.look_up(found_limits, search)
            n_stored += known is not None
            if known is None and executor is None and workers != 1:
                pool = worker_pool([found_limits.compute.__module__], workers)
                executor = closed_in_the_end.enter_context(pool)
            if known is not None:
                found = known.value
            elif run.output is None:
                found = run.store.run(found_limits, search, executor=executor)
            else:
                found = run_search(found_limits, search, f"{stem}_point{number + 1}", own, executor)
            limits = refine_to_tolerance(search, found.limits, model.tolerance, replace(own, progress=SilentProgress()))
            found = replace(found, limits=limits)
            result.append(convert_own_limits(case.limits, model, search.harmonic, found))
    return tuple(result)


@dataclass(frozen=True, kw_only=False)
class _Within:
    """Progress of one search as a share of that of all."""

    report: Report
    before: int
    total: int

    @contextmanager
    def step(self, name: str, *, expected: float | None = None) -> Iterator[Report]:
        """Report within the outer step."""
        del name, expected
        yield lambda done, total: self.report(self.before + done / total, self.total)
        self.report(self.before + 1, self.total)

    def stored(self, name: str) -> None:
        """Nothing is shown of what is stored."""
