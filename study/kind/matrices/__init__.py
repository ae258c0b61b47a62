"""Mass and stiffness that another program wrote."""

from study.case.kind import CASE_KINDS, CaseKind, OpenCase
from study.case.structure import Structure
from study.kind.matrices.table import MatricesTable
from study.run_context import Answer, RunContext


def make_structure(opened: OpenCase, run: RunContext) -> Structure:
    """Reduce the matrices unless that was done before."""
    from study.kind.matrices.reduce import reduce_matrices
    from study.reduce.structure import reduced_structure

    return reduced_structure(reduce_matrices(opened, run)[0].rom)


def run_reduce(opened: OpenCase, run: RunContext, checked: bool) -> Answer:
    """Write the reduced model, and compare reduced frequencies with full ones."""
    from study.kind.matrices.reduce import reduce_matrices_case

    return reduce_matrices_case(opened, run, checked)


CASE_KINDS.register(
    CaseKind(
        name="matrices",
        summary="matrices of another program",
        table=MatricesTable,
        structure=make_structure,
        reduce=run_reduce,
        modes=None,
    )
)
