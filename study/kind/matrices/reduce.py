"""``stickslip reduce`` of matrices that another program wrote: to the reduced model that ``stickslip solve`` takes."""

import importlib.metadata
from dataclasses import dataclass

import numpy as np

from casefile.mistakes import Mistakes
from casefile.table import at_key, located
from fe.errors import MatrixFileError
from fe.file.dof_table import DIRECTIONS, N_TRANSLATION
from fe.file.imported_matrices import ImportedMatrices, ImportedSystem, Rows
from fe.file.matrix_file import require_file
from pipeline.output import replace_file
from reduction.file.rom_hdf5 import save_rom
from study.case.kind import OpenCase
from study.case.tables import Case
from study.kind.matrices.message import at_file
from study.kind.matrices.reduction import checked_matrices, imported_matrices, reduced_matrices
from study.kind.matrices.table import UNITS, MatricesTable
from study.reduce.comparison import ComparedReduction
from study.reduce.report import frequency_document, frequency_lines
from study.run_context import Answer, RunContext


@dataclass(frozen=True, kw_only=True, eq=False)
class MatricesReduction:
    """A reduced structure, what it was made of, and the rows of the files that it recovers."""

    found: ComparedReduction
    read: ImportedMatrices
    free: ImportedSystem


def reduce_matrices(opened: OpenCase, run: RunContext) -> MatricesReduction:
    """Reduce the matrices of a case.

    Raises
    ------
    CaseError
        With every mistake of the case: files that cannot be read, nodes that no row belongs to, a support that leaves
        the interior loose.
    """
    case: Case[MatricesTable] = opened.case
    table, folder = case.structure, opened.folder
    files = table.files
    sources = {name: files.matrix(name, folder) for name in ("mass", "stiffness", "damping") if getattr(files, name)}
    dofs = None if files.dofs is None else folder / files.dofs
    mistakes = Mistakes(case)
    given = {name: source.file for name, source in sources.items()} | ({} if dofs is None else {"dofs": dofs})
    for name, file in given.items():
        with mistakes.at("structure", "files"), at_file(case, {name: file}):
            require_file(file)  # before the store looks at its contents
    mistakes.raise_if_any()
    with at_file(case, given):
        read = run.step("reading the matrices").run(
            imported_matrices,
            mass=sources["mass"],
            stiffness=sources["stiffness"],
            damping=sources.get("damping"),
            dofs=dofs,
            units=UNITS[files.units],
        )
    fixed, kept = _rows(case, read)
    if table.damping is not None and read.damping.nnz:
        with located(case, "structure", "damping"):
            raise MatrixFileError(
                f"ratio = {table.damping.ratio:g} meets matrices with damping of their own: remove one of the two"
            )
    with located(case, "structure", "files"):
        free = read.system(fixed)
    boundary = {name: free.row[rows] for name, rows in kept.items()}
    with located(case, "structure", "boundary"):
        found = run.step("reduction").run(
            reduced_matrices,
            system=free.linear,
            boundary=boundary,
            n_mode=table.reduction.modes,
            damping_ratio=None if table.damping is None else table.damping.ratio,
            provenance={
                "title": opened.title,
                "stickslip": importlib.metadata.version("stickslip"),
                "files": repr(files),
            },
        )
    return MatricesReduction(found=found, read=read, free=free)


def reduce_matrices_case(opened: OpenCase, run: RunContext, *, checked: bool = False) -> Answer:
    """Write the reduced model and the table of its full rows; with `checked`, its fixed-interface modes are checked.

    Raises
    ------
    CaseError
        As `reduce_matrices`.
    """
    assert run.output is not None
    reduced, check = reduce_matrices(opened, run), None
    if checked:
        with located(opened.case, "structure", "boundary"):
            step = run.step("check of the modes")
            check = step.run(checked_matrices, reduced.free.linear, reduced.found.rom)
    stem = opened.path.stem
    written = (run.output / f"{stem}_rom.h5", run.output / f"{stem}_dofs.csv")
    save_rom(reduced.found.rom, written[0])
    replace_file(written[1], _full_rows(reduced.read, reduced.free))
    files = [str(file) for file in written]
    n_mode = opened.case.structure.reduction.modes
    return Answer(
        document={**frequency_document(reduced.found, check), "files": files},
        text="\n".join([*frequency_lines(reduced.found, n_mode, check), "", *files]),
    )


def _rows(case: Case[MatricesTable], read: ImportedMatrices) -> tuple[Rows, dict[str, Rows]]:
    """Rows of the files that supports hold, and that the reduction keeps by name."""
    mistakes = Mistakes(case)
    held = [np.zeros(0, dtype=np.int64)]
    for number, support in enumerate(case.structure.support):
        with mistakes.at("structure", "support", number), at_key(case, "structure", "support", number, "nodes"):
            held.append(read.dofs.rows(support.nodes, support.numbers))
    every = np.unique(np.concatenate(held))
    kept: dict[str, Rows] = {}
    for number, table in enumerate(case.structure.boundary):
        with mistakes.at("structure", "boundary", number):
            with at_key(case, "structure", "boundary", number, "nodes"):
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
                    with at_key(case, "structure", "boundary", number, "name"):
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
