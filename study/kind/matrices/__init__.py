"""Mass and stiffness matrices of another program."""

from study.case.structure import Structure
from study.kind.matrices.table import MatricesTable
from study.kind.registry import CASE_KINDS, CaseKind, OpenCase
from study.run_context import Answer, RunContext


def _structure(opened: OpenCase, run: RunContext) -> Structure:
    from study.kind.matrices.reduce import make_matrices_structure

    return make_matrices_structure(opened, run)


def _reduce(opened: OpenCase, run: RunContext, checked: bool) -> Answer:
    from study.kind.matrices.reduce import reduce_matrices_case

    return reduce_matrices_case(opened, run, checked)


CASE_KINDS.register(
    CaseKind(
        name="matrices",
        summary="matrices of another program",
        table=MatricesTable,
        structure=_structure,
        reduce=_reduce,
        modes=None,
    )
)
