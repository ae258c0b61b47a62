"""A structure of plain matrices: a NumPy or MATLAB file, or a stored reduced model."""

from study.case.structure import Structure
from study.kind.plain.table import PlainTable
from study.kind.registry import CASE_KINDS, CaseKind, OpenCase
from study.run_context import RunContext


def _structure(opened: OpenCase, run: RunContext) -> Structure:
    from study.kind.plain.structure import read_plain_structure

    del run
    return read_plain_structure(opened.case, opened.folder)


CASE_KINDS.register(
    CaseKind(
        name="plain",
        summary="plain matrices",
        table=PlainTable,
        structure=_structure,
        reduce='its matrices are used as they are; for a reduction of large ones give kind = "matrices"',
        modes=None,
    )
)
