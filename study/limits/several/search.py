"""Search for the limits of all quantities as a stage, with one population and one set of histories for all."""

from collections.abc import Callable, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

from casefile.table import CaseModel, located
from correlation.model import Sensor
from hbsolve.errors import BalanceError
from hbsolve.limits.objective import Objective
from hbsolve.limits.result import ResponseLimits
from hbsolve.limits.several_limits import several_limits
from pipeline.store import stage
from study.limits.curve import LimitSearchResult, explained_failures
from study.limits.model import LimitSearch, Sweep, make_limit_search, make_objective
from study.limits.refinement import refine_to_tolerance
from study.limits.result import LimitCurves, convert_limits
from study.limits.several.progress import SeveralSearchProgress
from study.limits.several.quantity import Quantity, list_quantities
from study.limits.table import LimitsTable
from study.run_context import RunContext
from study.solve.model import SolveModel


@dataclass(frozen=True, kw_only=True, eq=False)
class SeveralSearch:
    """All inputs of a search for limits of several quantities.

    Parameters
    ----------
    first
        Search for the first quantity: system, frequencies, levels, box and effort are the same for all.
    names
        Name of each quantity.
    objectives
        Objective of each quantity.
    """

    first: LimitSearch
    names: tuple[str, ...]
    objectives: tuple[Objective, ...]

    def select(self, name: str, output: Sensor | None) -> LimitSearch:
        """Make the search for only one quantity, by its name; `output` is its sensor, or None for a force."""
        objective = self.objectives[self.names.index(name)]
        return replace(self.first, objective=objective, row=None if output is None else output.row)


def make_several_search(
    case: CaseModel, table: LimitsTable, sweep: Sweep, model: SolveModel
) -> tuple[SeveralSearch, tuple[Quantity, ...]]:
    """Make the search of a case, and its quantities.

    Parameters
    ----------
    case
        Case, for file and line of a mistake.
    table
        Table [limits] of the case.
    sweep
        Table [sweep] of the case, for keys that [limits] does not give; None if there is none.
    model
        Model of the case.

    Raises
    ------
    CaseError
        See `make_limit_search`.
    """
    with located(case, "limits"):
        quantities = list_quantities(table, model)
        objectives = tuple(make_objective(item.table, item.output, model) for item in quantities)
    first = make_limit_search(case, quantities[0].table, sweep, model)
    balance = first.balance()
    with located(case, "limits"):
        for item, objective in zip(quantities, objectives, strict=True):
            try:
                objective.check(balance)
            except BalanceError as error:
                raise BalanceError(f"the limits of the {item.name} cannot be computed: {error}") from error
    return SeveralSearch(first=first, names=tuple(item.name for item in quantities), objectives=objectives), quantities


@stage("response limits of all quantities", ignore=("tasks", "executor", "report"))
def search_several_limits(
    search: SeveralSearch,
    tasks: MutableMapping[str, Any] | None = None,
    executor: Executor | None = None,
    report: Callable[[float, float], None] | None = None,
) -> dict[str, ResponseLimits]:
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
    first = search.first
    with explained_failures():
        return several_limits(
            first.problem(), dict(zip(search.names, search.objectives, strict=True)), first.angular_frequency,
            first.levels, settings=first.settings, store=tasks, executor=executor,
            progress=None if report is None else SeveralSearchProgress(report),
        )  # fmt: skip


def convert_several_limits(
    search: SeveralSearch,
    quantities: Sequence[Quantity],
    limits: Mapping[str, ResponseLimits],
    model: SolveModel,
    run: RunContext,
) -> tuple[LimitCurves, ...]:
    """Refine the limits of each quantity to the tolerance of the case, and convert them into the units of reports.

    Parameters
    ----------
    search, quantities
        Result of `make_several_search`.
    limits
        Limits of each quantity by its name.
    model
        Model of the case.
    run
        Store and progress of the run.
    """
    curves = []
    for item in quantities:
        refined = refine_to_tolerance(
            search.select(item.name, item.output), limits[item.name], model.tolerance, run, item.name
        )
        own = LimitSearchResult(limits=refined, amplitude=None)
        curves.append(convert_limits(item.table, item.output, item.harmonic, own, model.motion_of(item.output)))
    return tuple(curves)
