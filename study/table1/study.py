"""A whole mesh study: what is to be computed, run side by side, and what comes out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from fe.calculix_run import find_ccx
from geometry.errors import InputError
from study.blade_case import ELEMENT_BY_NAME
from study.blade_model import BladeModel, blade_model
from study.case import located
from study.parallel import Task, run_parallel
from study.run_context import RunContext
from study.solid_check import SolidCheck, solid_check
from study.table1.case import ModelTable, PredictionTable, Table1Case
from study.table1.chain import RowResult, row
from study.table1.limit import Limit, NestedPoint, nested_point, richardson
from study.table1.prediction import Prediction, prediction, witness

#: CalculiX is asked about fully clamped rows up to this n p: its own solver takes minutes for the finer ones.
WITNESSED = 4
#: Building the solid takes as long as a small row.
CAD_WORK = 1e4


@dataclass(frozen=True, kw_only=True)
class StudyRow:
    """One row of the table: what was asked, and what came out."""

    asked: ModelTable
    result: RowResult
    calculix: float | None

    @property
    def error(self) -> float | None:
        """First full frequency minus the published one [Hz]."""
        return None if self.asked.paper is None else float(self.result.frequency[0]) - self.asked.paper


@dataclass(frozen=True, kw_only=True)
class MeshStudy:
    """All results of one case.

    Parameters
    ----------
    case
        What was asked.
    rows, predictions
        In the order of the case.
    nested, limit
        Frequencies of the nested meshes, and what they tend to; none if the case asks for none.
    solid
        CAD volume against mesh volume.
    asked_calculix
        Whether CalculiX was there to be asked.
    """

    case: Table1Case
    rows: tuple[StudyRow, ...]
    predictions: tuple[tuple[PredictionTable, Prediction], ...]
    nested: tuple[NestedPoint, ...]
    limit: Limit | None
    solid: SolidCheck
    asked_calculix: bool

    @property
    def worst_error(self) -> float:
        """Largest distance of a row from its published frequency [Hz]; 0 if none is published."""
        return max((abs(row.error) for row in self.rows if row.error is not None), default=0.0)


def run_study(case: Table1Case, run: RunContext, title: str) -> MeshStudy:
    """Compute a mesh study, or find its parts in the store.

    Parameters
    ----------
    case
        As `load_case` returned it.
    run
        Store and progress.
    title
        Of the progress step.

    Raises
    ------
    CaseError
        The blade, its material or its mesh cannot be built as the case says.
    """
    ask_calculix = find_ccx() is not None
    rows = [row_inputs(case, asked) for asked in case.model]
    untuned = [row_inputs(case, asked) for asked in case.prediction]
    seen_by_calculix = [
        number
        for number, each in enumerate(rows)
        if ask_calculix and not each.drop_every and each.through_thickness * each.rule.element.degree <= WITNESSED
    ]
    found = _run_groups(
        {
            "rows": [
                Task(stage=row, inputs={"inputs": r}, label=f"model {asked.model}", weight=_work(r))
                for asked, r in zip(case.model, rows, strict=True)
            ],
            "predictions": [
                Task(
                    stage=prediction,
                    inputs={"inputs": r, "ask_calculix": ask_calculix},
                    label=asked.name,
                    weight=_work(r) / 4,
                )
                for asked, r in zip(case.prediction, untuned, strict=True)
            ],
            "nested": [
                Task(stage=nested_point, inputs={"inputs": r}, label="nested mesh", weight=_work(r) / 4)
                for r in _nested(case, rows[0])
            ],
            "witness": [
                Task(stage=witness, inputs={"inputs": rows[n]}, label="CalculiX", weight=_work(rows[n]) / 4)
                for n in seen_by_calculix
            ],
            "solid": [Task(stage=solid_check, inputs={"inputs": rows[0]}, label="CAD solid", weight=CAD_WORK)],
        },
        run,
        title,
    )
    calculix = dict(zip(seen_by_calculix, found["witness"], strict=True))
    return MeshStudy(
        case=case,
        rows=tuple(
            StudyRow(asked=asked, result=result, calculix=calculix.get(number))
            for number, (asked, result) in enumerate(zip(case.model, found["rows"], strict=True))
        ),
        predictions=tuple(zip(case.prediction, found["predictions"], strict=True)),
        nested=tuple(found["nested"]),
        limit=_limit(case, found["nested"]),
        solid=found["solid"][0],
        asked_calculix=ask_calculix,
    )


def row_inputs(case: Table1Case, asked: ModelTable | PredictionTable) -> BladeModel:
    """What a row of the case depends on.

    Raises
    ------
    CaseError
        The blade, its material or its mesh cannot be built as the case says.
    """
    relaxed = isinstance(asked, ModelTable) and asked.root == "relaxed"
    return blade_model(
        case,
        element=asked.element,
        through_thickness=asked.elements_through_thickness,
        drop_every=case.root.drop_every if relaxed else 0,
        thickness_factor=asked.thickness_factor if isinstance(asked, PredictionTable) else 1.0,
    )


def _run_groups(groups: Mapping[str, Sequence[Task]], run: RunContext, title: str) -> dict[str, list[Any]]:
    """All tasks at once, their results by group."""
    outcomes = iter(run_parallel([task for tasks in groups.values() for task in tasks], run.store, run.progress, title))
    return {name: [next(outcomes).value for _ in tasks] for name, tasks in groups.items()}


def _work(inputs: BladeModel) -> float:
    """Rough work of a row, to start the heavy ones first and to show progress: nodes to the power 1.3."""
    blade, rule = inputs.blade, inputs.rule
    h = rule.size(blade.thickness)
    cells = rule.subdivisions**3 * rule.through_thickness * (blade.length / h) * (blade.chord / h)
    return float((cells * (4 if rule.element.degree == 2 else 1)) ** 1.3)


def _nested(case: Table1Case, inputs: BladeModel) -> list[BladeModel]:
    """The nested meshes of the case's limit: one coarse mesh, subdivided."""
    limit = case.limit
    if limit is None:
        return []
    with located(case, "limit"):
        coarse = replace(
            inputs,
            element=limit.element,
            through_thickness=limit.elements_through_thickness,
            length_cap=limit.length_cap,
            pads=limit.pads.pads(),
            drop_every=0,
        )
    return [replace(coarse, subdivisions=times) for times in limit.subdivisions]


def _limit(case: Table1Case, nested: Sequence[NestedPoint]) -> Limit | None:
    if case.limit is None:
        return None
    coarse, medium, fine = case.limit.subdivisions
    with located(case, "limit"):
        if medium * medium != coarse * fine:
            raise InputError(f"subdivisions = {case.limit.subdivisions} must grow by one ratio, such as [1, 2, 4]")
        degree = ELEMENT_BY_NAME[case.limit.element].degree
        return richardson([point.frequency for point in nested], medium / coarse, degree)
