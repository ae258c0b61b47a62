"""Stability of a response curve, as a stage."""

from collections.abc import Callable

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.stability.branch_stability import BranchStability, branch_stability
from pipeline.store import stage
from reduction.jointed_system import JointedSystem


@stage("curve stability", ignore=("report",))
def curve_stability(
    system: JointedSystem,
    branch: ResponseBranch,
    harmonics: int,
    n_sample: int,
    report: Callable[[float, float], None] | None = None,
) -> BranchStability:
    """Compute the stability of each point of a curve, and the bifurcations between the points.

    Parameters
    ----------
    system
        System with its loads at level 1.
    branch
        Points of the curve.
    harmonics, n_sample
        H, and samples per period, 0 for the solver's choice [-].
    report
        Function that receives the progress along the curve.
    """
    balance = HarmonicBalance(system=system, n_harmonic=harmonics + 1, n_sample=n_sample)
    return branch_stability(balance, branch, report=report)
