"""Limits of all quantities of a case as a stage: one population and one set of histories serve them all."""

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
    """All that limits of many quantities depend on.

    Parameters
    ----------
    first
        Search of the first of them: system, frequencies, levels, box and effort are those of all.
    names
        Name of each quantity.
    objectives
        What is bounded, in the order of the names.
    """

    first: LimitSearch
    names: tuple[str, ...]
    objectives: tuple[Objective, ...]

    def select(self, name: str, output: Sensor | None) -> LimitSearch:
        """Search of one quantity alone, by its name; the sensor whose amplitude it is, or None for a force."""
        objective = self.objectives[self.names.index(name)]
        return replace(self.first, objective=objective, row=None if output is None else output.row)


def make_several_search(
    case: CaseModel, table: LimitsTable, sweep: Sweep, model: SolveModel
) -> tuple[SeveralSearch, tuple[Quantity, ...]]:
    """The search that a case asks for, and its quantities.

    Parameters
    ----------
    case
        Names file and line of a mistake.
    table
        Table [limits] of the case.
    sweep
        Table [sweep] of the case, for what [limits] leaves out; None if there is none.
    model
        Model of the case.

    Raises
    ------
    CaseError
        As `make_limit_search`.
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
    """Search for the limits, or go on with a search that was stopped.

    Parameters
    ----------
    search
        Request of the case.
    tasks
        Results of those that are done.
    executor
        Runs them; this process by default.
    report
        Progress.

    Raises
    ------
    ComputationFailed
        No rest under the static load, or a process that was killed.
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
    """Convert the result of a search for each quantity, refined to the tolerance of the case, into its unit.

    Parameters
    ----------
    search, quantities
        As `make_several_search` gives them.
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
