"""One blade, clamped at its root."""

from study.case.kind import CASE_KINDS, CaseKind, OpenCase
from study.case.structure import Structure
from study.kind.blade.table import BladeStructureTable
from study.run_context import Answer, RunContext


def make_structure(opened: OpenCase, run: RunContext) -> Structure:
    """Reduce the blade unless that was done before."""
    from study.kind.blade.reduce import blade_structure

    return blade_structure(opened, run)


def run_reduce(opened: OpenCase, run: RunContext, checked: bool) -> Answer:
    """Write STEP, mesh, the reduced model and the response of its tip."""
    from study.kind.blade.reduce import reduce_blade_case

    return reduce_blade_case(opened, run, checked)


def run_modes(opened: OpenCase, run: RunContext, n_mode: int, film_of: int | None) -> Answer:
    """Draw the mode shapes of the whole blade."""
    from study.kind.blade.reduce import blade_modes

    return blade_modes(opened, run, n_mode, film_of)


CASE_KINDS.register(
    CaseKind(
        name="blade",
        summary="a blade",
        table=BladeStructureTable,
        structure=make_structure,
        reduce=run_reduce,
        modes=run_modes,
    )
)
