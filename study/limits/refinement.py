"""Refinement of limits by more harmonics, as a stage."""

from collections.abc import Callable

import numpy as np

from geometry.plain_number import format_number
from hbsolve.limits.loss_factor import LossFactor
from hbsolve.limits.refined_limits import refine_limits
from hbsolve.limits.result import ResponseLimits
from pipeline.store import stage
from study.limits.model import LimitSearch
from study.run_context import RunContext


@stage("refined limits", ignore=("report",))
def refined_limits(
    search: LimitSearch,
    limits: ResponseLimits,
    tolerance: float,
    report: Callable[[float, float], None] | None = None,
) -> ResponseLimits:
    """Compute limits with as many harmonics and samples as a tolerance requires.

    Parameters
    ----------
    search
        Search of the case.
    limits
        Limits from the search.
    tolerance
        Relative error of the bounded quantity [-].
    report
        Function that receives the progress over the limits.
    """
    rows = None if search.row is None else search.row[None]
    return refine_limits(search.problem(), limits, tolerance, rows=rows, report=report)


def refine_to_tolerance(
    search: LimitSearch, limits: ResponseLimits, tolerance: float | None, run: RunContext, name: str = ""
) -> ResponseLimits:
    """Refine limits to the tolerance of the case, if it has one, and warn if the tolerance is not reached.

    Parameters
    ----------
    search, limits
        Search and its limits.
    tolerance
        Tolerance of ``[harmonics]`` [-]; None if it is not given.
    run
        Store and progress of the run.
    name
        Name of the bounded quantity, if there are several.
    """
    if tolerance is None:
        return limits
    if isinstance(search.objective, LossFactor):
        run.warn(
            "tolerance of [harmonics] is not used for limits of the loss factor, which are computed with highest = "
            f"{search.harmonics}: raise highest, or bound the amplitude"
        )
        return limits
    with run.progress.step(f"harmonics of the limits{f' of the {name}' if name else ''}") as report:
        refined = run.store.run(refined_limits, search, limits, tolerance, report=report)
    there = np.isfinite(refined.value)
    beyond = there & ~(np.isfinite(refined.refined) & (refined.refined_error <= tolerance))
    if beyond.any():
        which = f" of the {name}" if name else ""
        run.warn(
            f"the truncation of harmonics and samples causes an error above {format_number(100 * tolerance)} % at "
            f"{beyond.sum()} of {there.sum()} limits{which}: raise highest or tolerance of [harmonics], now highest = "
            f"{search.harmonics}"
        )
    return refined
