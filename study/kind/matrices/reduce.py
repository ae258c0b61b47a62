"""``stickslip reduce`` of matrices that another program wrote: to the reduced model that ``stickslip solve`` takes."""

import importlib.metadata
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from casefile.errors import CaseError
from casefile.mistakes import Mistakes
from casefile.table import at_key, load_case, located
from fe.errors import MatrixFileError
from fe.file.dof_table import DIRECTIONS, N_TRANSLATION
from fe.file.imported_matrices import ImportedMatrices, ImportedSystem, Rows
from fe.file.matrix_file import require_file
from fe.mode_check import ModeCheck
from pipeline.output import replace_file
from reduction.file.rom_hdf5 import save_rom
from study.kind.matrices.message import at_file
from study.kind.matrices.reduction import checked_matrices, imported_matrices, reduced_matrices
from study.kind.matrices.table import UNITS, MatricesCase
from study.reduce.comparison import ComparedReduction
from study.run_context import RunContext


@dataclass(frozen=True, kw_only=True, eq=False)
class ReducedMatrices:
    """What the command reports: the reduction, how many modes were asked for, their check if any, and its files."""

    reduction: ComparedReduction
    n_mode: int
    check: ModeCheck | None
    files: tuple[Path, ...]


def run_reduce_matrices(path: Path, run: RunContext, *, checked: bool = False) -> ReducedMatrices:
    """Reduce the matrices of a case file and write the reduced model and the table of its full rows.

    With `checked`, its fixed-interface modes are checked too.

    Raises
    ------
    CaseError
        With every mistake of the case: files that cannot be read, nodes that no row belongs to, a support that leaves
        the interior loose.
    """
    assert run.output is not None
    case = load_case(path, MatricesCase)
    files, folder = case.files, path.parent
    sources = {name: files.matrix(name, folder) for name in ("mass", "stiffness", "damping") if getattr(files, name)}
    table = None if files.dofs is None else folder / files.dofs
    mistakes = Mistakes(case)
    given = {name: source.file for name, source in sources.items()} | ({} if table is None else {"dofs": table})
    for name, file in given.items():
        with mistakes.at("files"), at_file(case, {name: file}):
            require_file(file)  # before the store looks at its contents
    mistakes.raise_if_any()
    with at_file(case, given):
        read = run.step("reading the matrices").run(
            imported_matrices,
            mass=sources["mass"],
            stiffness=sources["stiffness"],
            damping=sources.get("damping"),
            dofs=table,
            units=UNITS[files.units],
        )
    held, kept = _rows(case, read)
    if case.damping is not None and read.damping.nnz:
        with located(case, "damping"):
            raise MatrixFileError(
                f"ratio = {case.damping.ratio:g} meets matrices with damping of their own: remove one of the two"
            )
    with located(case, "files"):
        free = read.system(held)
    boundary = {name: free.row[rows] for name, rows in kept.items()}
    with located(case, "boundary"):
        found = run.step("reduction").run(
            reduced_matrices,
            system=free.linear,
            boundary=boundary,
            n_mode=case.reduction.modes,
            damping_ratio=None if case.damping is None else case.damping.ratio,
            provenance={
                "title": case.title,
                "stickslip": importlib.metadata.version("stickslip"),
                "files": repr(files),
            },
        )
        check = run.step("check of the modes").run(checked_matrices, free.linear, found.rom) if checked else None
    written = (run.output / f"{path.stem}_rom.h5", run.output / f"{path.stem}_dofs.csv")
    save_rom(found.rom, written[0])
    replace_file(written[1], _full_rows(read, free))
    return ReducedMatrices(reduction=found, n_mode=case.reduction.modes, check=check, files=written)


def _rows(case: MatricesCase, read: ImportedMatrices) -> tuple[Rows, dict[str, Rows]]:
    """Rows of the files that supports hold, and that the reduction keeps by name."""
    mistakes = Mistakes(case)
    held = [np.zeros(0, dtype=np.int64)]
    for number, support in enumerate(case.support):
        with mistakes.at("support", number), at_key(case, "support", number, "nodes"):
            held.append(read.dofs.rows(support.nodes, support.numbers))
    every = np.unique(np.concatenate(held))
    kept: dict[str, Rows] = {}
    for number, table in enumerate(case.boundary):
        with mistakes.at("boundary", number):
            with at_key(case, "boundary", number, "nodes"):
                rows = read.dofs.rows(table.nodes, table.numbers)
                fixed = np.intersect1d(rows, every)
                if len(fixed):
                    raise MatrixFileError(
                        f'"{table.name}" keeps {read.dofs.name(int(fixed[0]))}, which a support holds: take it out of '
                        "one of the two"
                    )
            turning = read.dofs.direction[rows] >= N_TRANSLATION
            for name, own in ((table.name, rows[~turning]), (f"{table.name} rotation", rows[turning])):
                if name in kept:
                    with at_key(case, "boundary", number, "name"):
                        raise MatrixFileError(f'"{name}" is taken: give each boundary its own')
                if len(own):
                    kept[name] = own
    mistakes.raise_if_any()
    return every, kept


def _full_rows(read: ImportedMatrices, free: ImportedSystem) -> str:
    """Node and direction of each row of the reduced model's recovery, as CSV."""
    rows = np.flatnonzero(free.row >= 0)
    rows = rows[np.argsort(free.row[rows])]
    lines = [
        f"{number},{read.dofs.node[row]},{DIRECTIONS[read.dofs.direction[row]]}" for number, row in enumerate(rows)
    ]
    return "\n".join(["dof,node,direction", *lines, ""])


def refuse_to_solve(path: Path) -> None:
    """Say that a case of matrices is reduced first.

    Raises
    ------
    CaseError
        Always.
    """
    case = load_case(path, MatricesCase)
    assert case.source is not None
    raise CaseError(
        [
            case.source.problem(
                ("kind",),
                f'matrices are reduced first: run "stickslip reduce {path}", then solve a case whose [model] names '
                f"{path.stem}_rom.h5",
            )
        ]
    )
