"""Search for limits as a stage: each finished task is stored, and the result when all tasks are finished."""

from collections.abc import Callable, Iterator, MutableMapping
from concurrent.futures import BrokenExecutor, Executor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import ComputationFailed
from hbsolve.errors import NoSteadyState
from hbsolve.limits.loss_factor import LossFactor, loss_factor_limits
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.response_limits import response_limits
from hbsolve.limits.result import ResponseLimits
from hbsolve.limits.task import StageProgress
from pipeline.store import stage
from study.limits.model import LimitSearch

#: Progress at the end of each stage, measured on the wedge damper with 100 histories. The number of tasks that continue
#: states between frequencies and levels is not known beforehand; their progress stays within the range of the stage.
END = {
    "population": 0.38, "neighbours": 0.4, "levels": 0.42, "perturbations": 0.46, "gaps": 0.51, "audit": 0.98,
    "certificates": 1.0,
}  # fmt: skip
#: Smallest progress at which the time left is reported: the first tasks also load compiled code.
WORTH_REPORTING = 0.1
KILLED = (
    "a process of the search for limits was killed, most often for lack of memory: close other programs, or take "
    "fewer samples; finished tasks are stored, and the same command continues from there"
)


class SearchProgress:
    """Converter of reports of a search into increasing progress; tasks that were stored earlier do not count.

    Parameters
    ----------
    report
        Function that reports the progress of the step.
    """

    def __init__(self, report: Callable[[float, float], None]) -> None:
        self._report = report
        self._before = 0.0
        self._done = 0.0
        self._computed = False

    def __call__(self, progress: StageProgress) -> None:
        """See `hbsolve.limits.response_limits`."""
        names = list(END)
        number = names.index(progress.stage)
        begin = END[names[number - 1]] if number else 0.0
        share = begin + (END[progress.stage] - begin) * progress.done / max(progress.total, 1)
        self._done = max(self._done, share)
        # Progress counts from the first task that this run computes.
        if not self._computed:
            self._before = self._done
            self._computed = progress.done < progress.total
        elif self._done - self._before > WORTH_REPORTING * (1 - self._before):
            self._report(self._done - self._before, 1 - self._before)


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitSearchResult:
    """Result of a search for limits.

    Parameters
    ----------
    limits
        Limits of the objective.
    amplitude
        Amplitude of the output at the extreme loss factors, the largest one first, shape (2, l, f) [m]; None for other
        objectives.
    """

    limits: ResponseLimits
    amplitude: Float[NDArray[np.float64], "2 l f"] | None


@contextmanager
def explained_failures() -> Iterator[None]:
    """Turn failures of a search into a `ComputationFailed` with the remedy."""
    try:
        yield
    except NoSteadyState as error:
        raise ComputationFailed(f"limits: {error}") from error
    except BrokenExecutor as error:
        raise ComputationFailed(KILLED) from error


@stage("response limits", ignore=("tasks", "executor", "report"))
def search_limits(
    search: LimitSearch,
    tasks: MutableMapping[str, Any] | None = None,
    executor: Executor | None = None,
    report: Callable[[float, float], None] | None = None,
) -> LimitSearchResult:
    """Search for the limits, or continue a search that was interrupted.

    Parameters
    ----------
    search
        Search of the case.
    tasks
        Results of finished tasks.
    executor
        Executor of the tasks; this process by default.
    report
        Function that receives the progress.

    Raises
    ------
    ComputationFailed
        There is no state of rest under the static load, or a process was killed.
    """
    options: dict[str, Any] = {"settings": search.settings, "store": tasks, "executor": executor}
    if report is not None:
        options["progress"] = SearchProgress(report)
    problem = search.problem()
    with explained_failures():
        if not isinstance(search.objective, LossFactor):
            limits = response_limits(problem, search.angular_frequency, search.levels, **options)
            return LimitSearchResult(limits=limits, amplitude=None)
        assert search.row is not None
        assert search.reach is not None
        at_extremes = loss_factor_limits(
            problem.balance, OutputHarmonic(row=search.row, harmonic=search.harmonic, base=search.base),
            search.angular_frequency, search.levels, nominal=search.nominal, reach=search.reach, **options,
        )  # fmt: skip
        return LimitSearchResult(limits=at_extremes.loss_factor, amplitude=at_extremes.amplitude)
