"""A blade, clamped at its root."""

from study.case.structure import Structure
from study.kind.blade.table import BladeStructureTable
from study.kind.registry import CASE_KINDS, CaseKind, OpenCase
from study.run_context import Answer, RunContext


def _structure(opened: OpenCase, run: RunContext) -> Structure:
    from study.kind.blade.reduce import make_blade_structure

    return make_blade_structure(opened, run)


def _reduce(opened: OpenCase, run: RunContext, checked: bool) -> Answer:
    from study.kind.blade.reduce import reduce_blade_case

    return reduce_blade_case(opened, run, checked)


def _modes(opened: OpenCase, run: RunContext, n_mode: int, film_of: int | None) -> Answer:
    from study.kind.blade.reduce import draw_blade_modes

    return draw_blade_modes(opened, run, n_mode, film_of)


CASE_KINDS.register(
    CaseKind(
        name="blade",
        summary="a blade",
        table=BladeStructureTable,
        structure=_structure,
        reduce=_reduce,
        modes=_modes,
    )
)
