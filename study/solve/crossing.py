"""Branches that cross a response curve at its branch points, as a stage."""

from dataclasses import replace

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.stability.branch_stability import Bifurcation, BranchStability
from hbsolve.stability.crossing_branch import crossing_branches
from pipeline.store import stage
from reduction.jointed_system import JointedSystem
from study.solve.curve import RequestedCurve


@stage("crossing branches")
def find_crossing_branches(
    system: JointedSystem, branch: ResponseBranch, stability: BranchStability, harmonics: int, n_sample: int
) -> tuple[ResponseBranch, ...]:
    """Find the branches that leave a curve at its branch points, one to either side of each.

    Parameters
    ----------
    system
        System with its loads at level 1.
    branch
        Points of the curve.
    stability
        Stability of the curve, with its bifurcations.
    harmonics, n_sample
        H, and samples per period, 0 for the solver's choice [-].
    """
    balance = HarmonicBalance(system=system, n_harmonic=harmonics + 1, n_sample=n_sample)
    points = [point for point in stability.bifurcations if point.kind is Bifurcation.BRANCH_POINT]
    return tuple(result for point in points for result in crossing_branches(balance, branch, point))


def name_crossing_branch(curve: RequestedCurve, number: int) -> RequestedCurve:
    """Make the request of a crossing branch: that of the curve, labelled with the number of the branch."""
    return replace(curve, label=f"{curve.label}, branch {number}")
