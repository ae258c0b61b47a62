"""Refinement of a response curve by more harmonics, as a stage."""

from collections.abc import Callable

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.refined_branch import refine_branch
from pipeline.store import stage
from reduction.array_type import Matrix
from reduction.jointed_system import JointedSystem
from study.solve.curve import RequestedCurve


@stage("refined curve", ignore=("report",))
def refine_curve(
    system: JointedSystem,
    curve: RequestedCurve,
    branch: ResponseBranch,
    harmonics: int,
    n_sample: int,
    tolerance: float,
    rows: Matrix,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Compute the points of a curve with as many harmonics and samples as the outputs require.

    Parameters
    ----------
    system
        System with its loads at level 1.
    curve
        Request of the case.
    branch
        Points of the curve.
    harmonics, n_sample
        H, and samples per period, 0 for the solver's choice [-].
    tolerance
        Relative error of the main harmonic of each output [-].
    rows
        Rows of the outputs, shape (n, r) [-].
    report
        Function that receives the progress over the refined points.
    """
    balance = HarmonicBalance(system=system, n_harmonic=harmonics + 1, n_sample=n_sample)
    return refine_branch(balance, branch, tolerance, rows=rows, slider=curve.slider, report=report)
