"""Mesh study: its tasks, run in parallel, and its results."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from casefile.table import located
from fe.calculix_run import find_ccx
from fe.element import REGISTRY
from geometry.errors import InputError
from pipeline.parallel import Task, run_parallel
from pipeline.store import Stage
from study.kind.blade.model import BladeModel, SolidCheck, count_mesh_dofs, make_blade_model, solid_check
from study.run_context import RunContext
from study.table1.case import ModelTable, PredictionTable, Table1Case
from study.table1.stages import (
    Limit,
    NestedPoint,
    RowResult,
    UntunedPrediction,
    nested_point,
    prediction,
    quadratic,
    reference,
    richardson,
    row,
    witness,
)

#: Largest product n p of a fully clamped row that CalculiX computes; its solver takes minutes for finer rows.
WITNESSED = 4
#: Exponent of the degrees of freedom in the work; that of the factorisation alone is higher, that of the rest lower.
WORK_EXPONENT = 1.3
#: Memory of a process after its imports [byte].
PROCESS_MEMORY = 1.5e8
#: Memory limit of models that run in parallel, so that a laptop can compute the table [byte].
MEMORY = 3.2e9


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Cost of a stage, measured on one core: seconds at 10,000 degrees of freedom, and bytes per degree of freedom."""

    seconds: float
    memory: float


REDUCTION = Cost(seconds=3.0, memory=2.5e4)
ONE_MODE = Cost(seconds=0.5, memory=1.4e4)


@dataclass(frozen=True, kw_only=True)
class StudyRow:
    """Row of the table with its result."""

    table: ModelTable
    result: RowResult
    calculix: float | None

    @property
    def error(self) -> float | None:
        """First frequency of the full model minus the published one [Hz]; None if none is published."""
        return None if self.table.paper is None else float(self.result.frequency[0]) - self.table.paper

    @property
    def document(self) -> dict[str, Any]:
        """Row for the CSV file and for JSON; `hb_peak_hz` is the peak frequency, corrected for its shift by damping."""
        return {
            "model": self.table.model,
            "element": self.table.element,
            "elements_through_thickness": self.table.elements_through_thickness,
            "root": self.table.root,
            "frequency_hz": float(self.result.frequency[0]),
            "rom_frequency_hz": float(self.result.rom_frequency[0]),
            "hb_peak_hz": self.result.peak_natural,
            "paper_hz": self.table.paper,
            "calculix_hz": self.calculix,
            "n_dof": self.result.n_dof,
            "seconds": self.result.seconds,
            "memory_bytes": self.result.memory,
        }


@dataclass(frozen=True, kw_only=True)
class StudyPrediction:
    """Untuned row with its result, and the frequency by the closed form [Hz]."""

    table: PredictionTable
    result: UntunedPrediction
    theory: float


@dataclass(frozen=True, kw_only=True)
class MeshStudy:
    """All results of one case.

    Parameters
    ----------
    case
        Case.
    rows, predictions
        Results in the order of the case.
    nested, limit
        Frequencies of the nested meshes and their limit; empty and None if the case has no `limit` table.
    no_limit
        Reason why the frequencies have no limit; empty otherwise.
    solid
        Comparison of the CAD volume with the mesh volume.
    asked_calculix
        Whether CalculiX is installed.
    """

    case: Table1Case
    rows: tuple[StudyRow, ...]
    predictions: tuple[StudyPrediction, ...]
    nested: tuple[NestedPoint, ...]
    limit: Limit | None
    no_limit: str
    solid: SolidCheck
    asked_calculix: bool

    @property
    def worst_error(self) -> float:
        """Largest difference of a row from its published frequency [Hz]; 0 if none is published."""
        return max((abs(row.error) for row in self.rows if row.error is not None), default=0.0)


def run_study(case: Table1Case, run: RunContext, title: str) -> MeshStudy:
    """Compute a mesh study, or load its parts from the store.

    Parameters
    ----------
    case
        Case returned by `load_case`.
    run
        Store and progress.
    title
        Title of the progress step.

    Raises
    ------
    CaseError
        If the blade, its material or its mesh cannot be built from the values of the case.
    """
    ask_calculix = find_ccx() is not None
    rows = [make_row_inputs(case, table) for table in case.model]
    untuned = []
    for number, table in enumerate(case.prediction):
        with located(case, "prediction", number):
            untuned.append(make_row_inputs(case, table))
    # Predictions for the same thickness of the blade have the same reference.
    references = list(dict.fromkeys(quadratic(r) for r in untuned))
    seen_by_calculix = [
        number
        for number, item in enumerate(rows)
        if ask_calculix and not item.drop_every and item.through_thickness * item.rule.element.degree <= WITNESSED
    ]
    with located(case, "mesh"):  # a task needs the size of its mesh: a mesh that cannot be built raises here
        tasks = {
            "rows": [
                _make_task(row, r, f"model {table.model}", REDUCTION, run)
                for table, r in zip(case.model, rows, strict=True)
            ],
            "predictions": [
                _make_task(prediction, r, table.name, ONE_MODE, run, ask_calculix=ask_calculix)
                for table, r in zip(case.prediction, untuned, strict=True)
            ],
            "references": [_make_task(reference, r, "quadratic model", ONE_MODE, run) for r in references],
            "witness": [_make_task(witness, rows[n], "CalculiX", ONE_MODE, run) for n in seen_by_calculix],
            "solid": [_make_task(solid_check, rows[0], "CAD solid", ONE_MODE, run)],
        }
    with located(case, "limit"):
        tasks["nested"] = [
            _make_task(nested_point, r, "nested mesh", ONE_MODE, run) for r in _list_nested(case, rows[0])
        ]
    outcome = _run_groups(tasks, run, title)
    quadratic_frequency = dict(zip(references, outcome["references"], strict=True))
    calculix = dict(zip(seen_by_calculix, outcome["witness"], strict=True))
    limit, no_limit = _limit(case, outcome["nested"])
    return MeshStudy(
        case=case,
        rows=tuple(
            StudyRow(table=table, result=result, calculix=calculix.get(number))
            for number, (table, result) in enumerate(zip(case.model, outcome["rows"], strict=True))
        ),
        predictions=tuple(
            StudyPrediction(table=table, result=result, theory=result.factor * quadratic_frequency[quadratic(r)])
            for table, result, r in zip(case.prediction, outcome["predictions"], untuned, strict=True)
        ),
        nested=tuple(outcome["nested"]),
        limit=limit,
        no_limit=no_limit,
        solid=outcome["solid"][0],
        asked_calculix=ask_calculix,
    )


def make_row_inputs(case: Table1Case, table: ModelTable | PredictionTable) -> BladeModel:
    """Inputs of a row of the case.

    Raises
    ------
    CaseError
        If the blade, its material or its mesh cannot be built from the values of the case.
    """
    relaxed = isinstance(table, ModelTable) and table.root == "relaxed"
    return make_blade_model(
        case,
        case,
        element=table.element,
        through_thickness=table.elements_through_thickness,
        drop_every=case.root.drop_every if relaxed else 0,
        thickness_factor=table.thickness_factor if isinstance(table, PredictionTable) else 1.0,
    )


def _run_groups(groups: Mapping[str, Sequence[Task]], run: RunContext, title: str) -> dict[str, list[Any]]:
    """Run all tasks in one pool; results by group."""
    tasks = [task for group in groups.values() for task in group]
    outcomes = iter(run_parallel(tasks, run.store, run.progress, title, memory=MEMORY))
    return {name: [next(outcomes).value for _ in group] for name, group in groups.items()}


def _make_task(
    result: Stage[Any, Any], model: BladeModel, label: str, cost: Cost, run: RunContext, **further: Any
) -> Task:
    """Task on a model, with work and memory estimated from the size of its mesh."""
    n_dof = run.store.run(count_mesh_dofs, model)
    return Task(
        stage=result,
        inputs={"inputs": model, **further},
        label=label,
        weight=cost.seconds * (n_dof / 1e4) ** WORK_EXPONENT,
        memory=PROCESS_MEMORY + cost.memory * n_dof,
    )


def _list_nested(case: Table1Case, inputs: BladeModel) -> list[BladeModel]:
    """Nested meshes for the limit of the case: subdivisions of one coarse mesh."""
    limit = case.limit
    if limit is None:
        return []
    coarse = replace(
        inputs,
        element=limit.element,
        through_thickness=limit.elements_through_thickness,
        length_cap=limit.length_cap,
        pads=limit.pads.pads(),
        drop_every=0,
    )
    return [replace(coarse, subdivisions=times) for times in limit.subdivisions]


def _limit(case: Table1Case, nested: Sequence[NestedPoint]) -> tuple[Limit | None, str]:
    """Limit, or None with the reason; a study without a limit is still valid."""
    if case.limit is None:
        return None, ""
    coarse, medium, _ = case.limit.subdivisions
    degree = REGISTRY[case.limit.element].degree
    try:
        return richardson([point.frequency for point in nested], medium / coarse, degree), ""
    except InputError as error:
        return None, str(error)
