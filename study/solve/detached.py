"""Detached curves beside a response curve, as a stage."""

from collections.abc import Callable
from dataclasses import replace

from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.continuation_parameter import FrequencyPath
from hbsolve.continuation.detached import detached_curves
from hbsolve.continuation.stop_reason import StopReason
from pipeline.store import stage
from reduction.jointed_system import JointedSystem
from study.solve.curve import RequestedCurve, make_continuation


@stage("detached curves", ignore=("report",))
def find_detached_curves(
    system: JointedSystem,
    curve: RequestedCurve,
    branch: ResponseBranch,
    harmonics: int,
    n_sample: int,
    report: Callable[[float, float], None] | None = None,
) -> tuple[ResponseBranch, ...]:
    """Find isolas and other curves over frequency that are not connected to a curve.

    Parameters
    ----------
    system
        System with its loads at level 1.
    curve
        Request of the case, over frequency.
    branch
        Points of the curve.
    harmonics, n_sample
        H, and samples per period, 0 for the solver's choice [-].
    report
        Function that receives the progress over the searched frequencies.
    """
    path = make_continuation(system, curve, harmonics, n_sample).path
    assert isinstance(path, FrequencyPath)
    return detached_curves(
        path.balance, branch, curve.first, curve.last,
        level_power=curve.level_power, step=curve.step, slider=curve.slider, report=report,
    )  # fmt: skip


def name_detached_curve(curve: RequestedCurve, branch: ResponseBranch, number: int) -> RequestedCurve:
    """Make the request of a detached curve: that of the curve beside it, labelled with kind and number."""
    kind = "isola" if branch.stop_reason is StopReason.ISOLA else "detached"
    return replace(curve, label=f"{curve.label}, {kind} {number}")
