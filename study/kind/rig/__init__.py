"""The whole rig: blade, dampers and de-couplers."""

from typing import TYPE_CHECKING

from study.case.structure import Structure
from study.kind.registry import CASE_KINDS, CaseKind, Extras, OpenCase
from study.kind.rig.table import RigTable
from study.run_context import Answer, RunContext

if TYPE_CHECKING:
    from study.case.setup import ReadCase
    from study.solve.run import SolveResult


def _structure(opened: OpenCase, run: RunContext) -> Structure:
    from study.kind.rig.structure import make_rig_structure

    return make_rig_structure(opened.case, run)


def _reduce(opened: OpenCase, run: RunContext, checked: bool) -> Answer:
    from study.kind.rig.reduce import reduce_rig_case

    return reduce_rig_case(opened, run, checked)


def _after_solve(read: "ReadCase", result: "SolveResult", run: RunContext) -> Extras:
    from study.kind.rig.solve import report_rig_extras

    return report_rig_extras(read, result, run)


CASE_KINDS.register(
    CaseKind(
        name="rig",
        summary="a rig",
        table=RigTable,
        structure=_structure,
        reduce=_reduce,
        modes="`stickslip reduce` computes and draws the modes of a rig, with all contacts stuck",
        solved=_after_solve,
    )
)
