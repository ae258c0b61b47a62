"""The shipped rig for benchmarks: its case with other values, and its model from stored bodies."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from pipeline.cache_folder import default_folder
from pipeline.progress import LineProgress
from pipeline.store import Store
from study.case.setup import ReadCase, read_case
from study.case.tables import Case
from study.kind.registry import OpenCase
from study.kind.rig.structure import PreloadedRig
from study.kind.rig.table import RigTable
from study.run_context import RunContext, silent_run
from study.solve.model import SolveModel, make_solve_model


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedRig:
    """Rig prepared for a solution.

    Parameters
    ----------
    case
        Case as read.
    preloaded
        Rig under its dead weights.
    model
        System with loads, outputs and curves.
    """

    case: Case[RigTable]
    preloaded: PreloadedRig
    model: SolveModel


def with_tables(case: Case[RigTable], **tables: Mapping[str, Any]) -> Case[RigTable]:
    """Case with other values in tables of ``[structure]``, by name."""
    structure = case.structure
    changed = {name: getattr(structure, name).model_copy(update=dict(values)) for name, values in tables.items()}
    return case.model_copy(update={"structure": structure.model_copy(update=changed)})


def stored_run() -> RunContext:
    """Run that reuses stored reduced bodies and prints one line for each other body."""
    return replace(silent_run(), store=Store(default_folder()), progress=LineProgress())


def prepared(opened: OpenCase, **tables: Mapping[str, Any]) -> PreparedRig:
    """Prepare the rig of a case with other values in tables of ``[structure]``."""
    read: ReadCase = read_case(replace(opened, case=with_tables(opened.case, **tables)), run=stored_run())
    return PreparedRig(case=read.opened.case, preloaded=read.structure.details, model=make_solve_model(read))
