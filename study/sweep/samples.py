"""Response curves of a case at many values of its parameters: each value is one case, and each curve is stored."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from casefile.table import located
from geometry.errors import ComputationFailed, InputError
from pipeline.parallel import Task
from pipeline.pool import run_pooled
from pipeline.progress import SilentProgress
from pipeline.worker_pool import Workers
from study.case.setup import read_case
from study.kind.registry import OpenCase
from study.run_context import RunContext
from study.solve.model import SolveModel, make_solve_model
from study.sweep.curve import PointCurve, point_curve
from study.sweep.parameter import CaseParameter, ParameterError, vary

#: What the case holds at a point.
Point = Mapping[CaseParameter, object]


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledCurves:
    """Curves of all points.

    Parameters
    ----------
    model
        Model of the case itself, whose outputs and curves those of all points are.
    curves
        Curves of each point, in the order of the case.
    """

    model: SolveModel
    curves: tuple[tuple[PointCurve, ...], ...]

    @property
    def failures(self) -> list[str]:
        """Why a curve does not reach the end of its range, of each such curve."""
        return [item.stop_message for point in self.curves for item in point if not item.complete]


def point_model(opened: OpenCase, point: Point, run: RunContext) -> SolveModel:
    """The model of a point: that of the case with these values.

    Raises
    ------
    CaseError
        As `stickslip solve` would say it of the case with these values.
    """
    varied = vary(opened, point)
    quiet = replace(run, progress=SilentProgress())
    with located(varied.case, "structure"):
        return make_solve_model(read_case(varied, run=quiet))


def compute_curves(
    opened: OpenCase, points: Sequence[Point], model: SolveModel, run: RunContext, workers: Workers = None
) -> SampledCurves:
    """Curves of all points; one that is stored is not computed again.

    Parameters
    ----------
    opened
        The case.
    points
        Values of the parameters.
    model
        Model of the case itself.
    run
        Store and progress of the run.
    workers
        Processes [-]; one for each core by default, this process for 1. Or the address of a dask scheduler.

    Raises
    ------
    CaseError
        A point that is no sound case.
    ComputationFailed
        No curve could be started.
    """
    n_curve = len(model.curves)

    def tasks() -> Iterator[Task]:
        for number, point in enumerate(points):
            try:
                own = point_model(opened, point, run)
            except InputError as error:
                values = ", ".join(f"{item.name} = {value}" for item, value in point.items())
                raise ParameterError(f"with {values}: {error}") from error
            # What the other curves are is nothing that a stored curve depends on.
            alone = replace(own, curves=())
            for curve in own.curves:
                inputs = {"model": alone, "curve": curve}
                yield Task(stage=point_curve, inputs=inputs, label=f"point {number + 1}, {curve.label}")

    title = f"{len(points) * n_curve} curves at {len(points)} points"
    point_curves: list[PointCurve] = run_pooled(tasks(), len(points) * n_curve, run.store, run.progress, title, workers)
    curves = tuple(tuple(point_curves[first : first + n_curve]) for first in range(0, len(point_curves), n_curve))
    result = SampledCurves(model=model, curves=curves)
    if not any(len(item.frequency) for item in point_curves):
        raise ComputationFailed(f"none of the {len(point_curves)} curves could be started: {result.failures[0]}")
    return result
