"""Response limits of a case at many values of its parameters; finished searches are stored."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import Any

from casefile.table import located
from pipeline.progress import Report, SilentProgress
from pipeline.store import Stage
from pipeline.worker_pool import Workers, worker_pool
from study.case.setup import read_case
from study.case.tables import Case
from study.kind.registry import OpenCase
from study.limits.curve import search_limits
from study.limits.model import make_limit_search
from study.limits.result import LimitCurves, convert_own_limits
from study.limits.several.quantity import Quantity, own_quantity
from study.limits.several.search import convert_several_limits, make_several_search, search_several_limits
from study.limits.stored_search import run_search
from study.limits.table import EVERYTHING
from study.run_context import RunContext
from study.solve.model import SolveModel, make_vibrating_model
from study.sweep.parameter import vary
from study.sweep.result import SampledLimits
from study.sweep.samples import Point


def asks_for_limits(opened: OpenCase) -> bool:
    """Whether a case has a table [limits]."""
    return opened.case.source is not None and "limits" in opened.case.source.data


def compute_limits(
    opened: OpenCase, points: Sequence[Point], stem: str, run: RunContext, workers: Workers = None
) -> tuple[SampledLimits, ...]:
    """Compute the limits of each quantity at all points; stored searches are used, interrupted ones are continued.

    Parameters
    ----------
    opened
        Case of the limits.
    points
        Values of the parameters.
    stem
        Stem of the folders of unfinished searches.
    run
        Output folder, store and progress of the run.
    workers
        Number of processes [-]; one for each core by default, this process for 1. Or the address of a dask scheduler.

    Raises
    ------
    CaseError
        The case is invalid at a point.
    ComputationFailed
        There is no state of rest under the static load, or a process was killed.
    """
    quantities: tuple[Quantity, ...] = ()
    curves: list[Sequence[LimitCurves]] = []
    with run.progress.step(f"limits at {len(points)} points") as report, ExitStack() as closed_in_the_end:
        executor: Executor | None = None
        n_stored = 0
        for number, point in enumerate(points):
            within = _ShareOfProgress(report, number - n_stored, len(points) - n_stored)
            varied = vary(opened, point)
            case = varied.case
            model = make_vibrating_model(read_case(varied, run=replace(run, progress=SilentProgress())))
            with located(case, "limits"):
                own = _make_request(case, model)
            known = run.store.look_up(own.search_stage, own.search)
            n_stored += known is not None
            if known is None and executor is None and workers != 1:
                pool = worker_pool([own.search_stage.compute.__module__], workers)
                executor = closed_in_the_end.enter_context(pool)
            if known is not None:
                result = known.value
            elif run.output is None:
                result = run.store.run(own.search_stage, own.search, executor=executor)
            else:
                stem_of_point = f"{stem}_point{number + 1}"
                result = run_search(
                    own.search_stage, own.search, stem_of_point, replace(run, progress=within), executor
                )
            quantities = own.quantities
            curves.append(own.convert(result, replace(run, progress=SilentProgress())))
    return tuple(
        SampledLimits(quantity=quantity, points=tuple(points))
        for quantity, *points in zip(quantities, *curves, strict=True)
    )


@dataclass(frozen=True, kw_only=True)
class _LimitRequest:
    """Search of a case, its stage, its quantities, and the conversion of its result into limits."""

    search_stage: Stage[..., Any]
    search: object
    quantities: tuple[Quantity, ...]
    convert: Callable[[Any, RunContext], Sequence[LimitCurves]]


def _make_request(case: Case[Any], model: SolveModel) -> _LimitRequest:
    if case.limits.objective == EVERYTHING:
        several, quantities = make_several_search(case, case.limits, case.sweep, model)
        return _LimitRequest(
            search_stage=search_several_limits, search=several, quantities=quantities,
            convert=lambda result, run: convert_several_limits(several, quantities, result, model, run),
        )  # fmt: skip
    search, quantity = make_limit_search(case, case.limits, case.sweep, model), own_quantity(case.limits, model)
    return _LimitRequest(
        search_stage=search_limits, search=search, quantities=(quantity,),
        convert=lambda result, run: (convert_own_limits(search, case.limits, result, model, run),),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=False)
class _ShareOfProgress:
    """Progress of one search as a part of the progress of all."""

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
        """Do nothing: stored steps are not shown."""
