"""The user's part, from a STEP file or a mesh file."""

from study.case.structure import Structure
from study.kind.part.table import PartTable
from study.kind.registry import CASE_KINDS, CaseKind, OpenCase
from study.run_context import Answer, RunContext


def _structure(opened: OpenCase, run: RunContext) -> Structure:
    from study.kind.part.reduce import make_part_structure

    return make_part_structure(opened, run)


def _reduce(opened: OpenCase, run: RunContext, checked: bool) -> Answer:
    from study.kind.part.reduce import reduce_part_case

    return reduce_part_case(opened, run, checked)


CASE_KINDS.register(
    CaseKind(
        name="part",
        summary="a part",
        table=PartTable,
        structure=_structure,
        reduce=_reduce,
        modes="`stickslip reduce` computes and draws the modes of a part",
    )
)
