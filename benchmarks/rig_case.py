"""The shipped rig as benchmarks need it: its case with other numbers, and its model from stored bodies."""

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
    """A rig that is ready to be solved.

    Parameters
    ----------
    case
        As it was read.
    preloaded
        Under its dead weights.
    model
        Loads, outputs and curves.
    """

    case: Case[RigTable]
    preloaded: PreloadedRig
    model: SolveModel


def with_tables(case: Case[RigTable], **tables: Mapping[str, Any]) -> Case[RigTable]:
    """The same case with other values in tables of ``[structure]``, by name."""
    structure = case.structure
    changed = {name: getattr(structure, name).model_copy(update=dict(values)) for name, values in tables.items()}
    return case.model_copy(update={"structure": structure.model_copy(update=changed)})


def stored_run() -> RunContext:
    """A run that takes bodies which were reduced before, and shows the others a line each."""
    return replace(silent_run(), store=Store(default_folder()), progress=LineProgress())


def prepared(opened: OpenCase, **tables: Mapping[str, Any]) -> PreparedRig:
    """The rig of a case, with other values in tables of ``[structure]``."""
    read: ReadCase = read_case(replace(opened, case=with_tables(opened.case, **tables)), run=stored_run())
    return PreparedRig(case=read.opened.case, preloaded=read.structure.details, model=make_solve_model(read))
