"""Response curves of a case at many values of its parameters; finished curves are stored."""

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

#: Entries of the case file at a point.
Point = Mapping[CaseParameter, object]


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledCurves:
    """Curves of all points.

    Parameters
    ----------
    model
        Model of the case itself; its outputs and requested curves are those of all points.
    curves
        Curves of each point, in the order of the case.
    """

    model: SolveModel
    curves: tuple[tuple[PointCurve, ...], ...]

    @property
    def failures(self) -> list[str]:
        """Reasons of all curves that do not reach the end of their range."""
        return [item.stop_message for point in self.curves for item in point if not item.complete]


def point_model(opened: OpenCase, point: Point, run: RunContext) -> SolveModel:
    """Make the model of the case with the values of a point.

    Raises
    ------
    CaseError
        The case with these values is invalid; the messages are those of `stickslip solve`.
    """
    varied = vary(opened, point)
    quiet = replace(run, progress=SilentProgress())
    with located(varied.case, "structure"):
        return make_solve_model(read_case(varied, run=quiet))


def compute_curves(
    opened: OpenCase, points: Sequence[Point], model: SolveModel, run: RunContext, workers: Workers = None
) -> SampledCurves:
    """Compute the curves of all points; stored curves are used.

    Parameters
    ----------
    opened
        Case of the curves.
    points
        Values of the parameters.
    model
        Model of the case itself.
    run
        Store and progress of the run.
    workers
        Number of processes [-]; one for each core by default, this process for 1. Or the address of a dask scheduler.

    Raises
    ------
    CaseError
        The case is invalid at a point.
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
            # Without the requests of other curves, on which a stored curve does not depend.
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
