"""Limits of a case as a stage: each task is kept when it is done, and the whole when all are."""

from collections.abc import Callable, MutableMapping
from concurrent.futures import BrokenExecutor, Executor
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import ComputationFailed
from hbsolve.errors import NoSteadyState
from hbsolve.limits.loss_factor import LossFactor, paper_limits
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.response_limits import response_limits
from hbsolve.limits.result import ResponseLimits
from pipeline.store import stage
from study.limits.progress import SearchProgress
from study.limits.search import LimitSearch


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundLimits:
    """What a search found.

    Parameters
    ----------
    limits
        Of the objective.
    amplitude
        Of the output where the loss factor is extreme, first where it is largest, shape (2, l, f) [m]; None for other
        objectives.
    """

    limits: ResponseLimits
    amplitude: Float[NDArray[np.float64], "2 l f"] | None


@stage("response limits", ignore=("kept", "executor", "report"))
def found_limits(
    search: LimitSearch,
    kept: MutableMapping[str, Any] | None = None,
    executor: Executor | None = None,
    report: Callable[[float, float], None] | None = None,
) -> FoundLimits:
    """Search for the limits, or go on with a search that was stopped.

    Parameters
    ----------
    search
        What is asked for.
    kept
        Results of its tasks.
    executor
        Runs them; this process by default.
    report
        Progress.

    Raises
    ------
    ComputationFailed
        No rest under the static load, or a process that was killed.
    """
    options: dict[str, Any] = {"settings": search.settings, "store": kept, "executor": executor}
    if report is not None:
        options["progress"] = SearchProgress(report)
    problem = search.problem()
    try:
        if not isinstance(search.objective, LossFactor):
            limits = response_limits(problem, search.angular_frequency, search.levels, **options)
            return FoundLimits(limits=limits, amplitude=None)
        assert search.row is not None
        assert search.reach is not None
        paper = paper_limits(
            problem.balance, OutputHarmonic(row=search.row, harmonic=search.harmonic),
            search.angular_frequency, search.levels, nominal=search.nominal, reach=search.reach, **options,
        )  # fmt: skip
        return FoundLimits(limits=paper.loss_factor, amplitude=paper.amplitude)
    except NoSteadyState as error:
        raise ComputationFailed(f"limits: {error}") from error
    except BrokenExecutor as error:
        raise ComputationFailed(
            "a process of the search for limits was killed, most often for lack of memory: close other programs, or "
            "take fewer samples; what was finished is kept, and the same command goes on from there"
        ) from error
