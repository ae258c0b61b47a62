"""The whole rig: blade, dampers and de-couplers."""

from typing import TYPE_CHECKING

from study.case.kind import CASE_KINDS, CaseKind, Extras, OpenCase
from study.case.structure import Structure
from study.kind.rig.table import RigTable
from study.run_context import Answer, RunContext

if TYPE_CHECKING:
    from study.case.setup import ReadCase
    from study.solve.run import Solved


def make_structure(opened: OpenCase, run: RunContext) -> Structure:
    """Reduce the bodies unless that was done before, and let them rest under the dead weights."""
    from study.kind.rig.structure import rig_structure

    return rig_structure(opened.case, run)


def run_reduce(opened: OpenCase, run: RunContext, checked: bool) -> Answer:
    """Write STEP, meshes with modes, the reduced assembly and pictures."""
    from study.kind.rig.reduce import reduce_rig_case

    return reduce_rig_case(opened, run, checked)


def after_solve(read: "ReadCase", found: "Solved", run: RunContext) -> Extras:
    """Contact forces, load cells and a film at the highest points."""
    from study.kind.rig.solve import extra_answer

    return extra_answer(read, found, run)


CASE_KINDS.register(
    CaseKind(
        name="rig",
        summary="a rig",
        table=RigTable,
        structure=make_structure,
        reduce=run_reduce,
        modes="`stickslip reduce` computes and draws the modes of a rig, with all contacts stuck",
        solved=after_solve,
    )
)
