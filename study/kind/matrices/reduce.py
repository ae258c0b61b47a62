"""``stickslip reduce`` of matrices of another program to the reduced model for ``stickslip solve``."""

import importlib.metadata
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from casefile.table import Mistakes, at_key, located
from fe.errors import MatrixFileError
from fe.file.dof_table import DIRECTIONS, N_TRANSLATION
from fe.file.imported_matrices import ImportedMatrices, ImportedSystem, Rows, Units, read_matrices
from fe.file.matrix_file import MatrixSource, require_file
from fe.mode_check import ModeCheck
from fe.system import LinearSystem
from pipeline.output import replace_file
from pipeline.store import stage
from reduction.base_excitation import BaseMotion
from reduction.errors import JointError
from reduction.file.rom_hdf5 import save_rom
from reduction.rom import ReducedModel
from reduction.rom_error import check_fixed_interface_modes
from study.case.structure import Structure, make_reduced_structure
from study.case.tables import Case
from study.kind.matrices.table import UNITS, MatricesTable
from study.kind.registry import OpenCase
from study.reduce.comparison import ComparedReduction, compare_reduction
from study.reduce.report import report_reduction
from study.run_context import Answer, RunContext


@stage("imported matrices")
def imported_matrices(
    mass: MatrixSource, stiffness: MatrixSource, damping: MatrixSource | None, dofs: Path | None, units: Units
) -> ImportedMatrices:
    """Read and check the matrices; the stored result depends on the contents of the files."""
    return read_matrices(mass, stiffness, damping=damping, dofs=dofs, units=units)


@stage("reduced matrices")
def reduced_matrices(
    system: LinearSystem,
    boundary: Mapping[str, Rows],
    n_mode: int,
    damping_ratio: float | None,
    provenance: Mapping[str, str],
) -> ComparedReduction:
    """Reduce and damp a system, and compare it with the full system.

    For the arguments see `compare_reduction`.

    Raises
    ------
    MatrixFileError
        The reduced model is indefinite, because mass or stiffness is written with too few digits or is wrong.
    """
    try:
        return compare_reduction(system, boundary, n_mode, damping_ratio, provenance)
    except np.linalg.LinAlgError as error:
        raise MatrixFileError(
            f"the modes of the reduced model cannot be computed ({error}): check signs and units of mass and "
            "stiffness, and write them with more digits"
        ) from error


@stage("check of reduced matrices")
def checked_matrices(system: LinearSystem, rom: ReducedModel) -> ModeCheck:
    """Check the fixed-interface modes of a system's reduced model."""
    return check_fixed_interface_modes(system, rom)


def reduce_matrices(opened: OpenCase, run: RunContext) -> tuple[ComparedReduction, ImportedMatrices, ImportedSystem]:
    """Read and reduce the matrices of a case; return reduction, matrices of the files, and system on its supports.

    Raises
    ------
    CaseError
        If the case has mistakes: files that cannot be read, nodes without rows in the matrices, supports that leave
        rigid motions of the interior.
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
            require_file(file)  # before the store reads the contents
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
    fixed, retained = _find_rows(case, read)
    ratio = None if table.damping is None else table.damping.viscous_ratio
    if ratio is not None and read.damping.nnz:
        with located(case, "structure", "damping"):
            raise MatrixFileError(
                f"ratio = {ratio:g} is given, but the files already contain a damping matrix: remove one of the two"
            )
    with located(case, "structure", "files"):
        free = read.system(fixed)
    boundary = {name: free.row[rows] for name, rows in retained.items()}
    with located(case, "structure", "boundary"):
        result = run.step("reduction").run(
            reduced_matrices,
            system=free.linear,
            boundary=boundary,
            n_mode=table.reduction.modes,
            damping_ratio=ratio,
            provenance={
                "title": opened.title,
                "stickslip": importlib.metadata.version("stickslip"),
                "files": repr(files),
            },
        )
    return result, read, free


def make_matrices_structure(opened: OpenCase, run: RunContext) -> Structure:
    """Make the structure of the reduced matrices of a case; its supports may be a moving base."""
    result, read, free = reduce_matrices(opened, run)

    def base(axis: str) -> BaseMotion:
        if len(free.linear.free) == read.dofs.n_dof:
            raise JointError(f'base = "{axis}": no [[structure.support]] fixes the structure to a base that could move')
        motion = (read.dofs.direction == DIRECTIONS.index(axis)).astype(np.float64)
        order = np.flatnonzero(free.row >= 0)
        order = order[np.argsort(free.row[order])]
        return BaseMotion.reduced(result.rom, motion[order], (read.mass @ motion)[order])

    damping = opened.case.structure.damping
    structure = make_reduced_structure(
        result.rom, base=base, loss_factor=0.0 if damping is None else damping.loss_factor
    )
    # A case names nodes by their numbers in the files; the reduced model has rotations at extra nodes after the others.
    label = np.unique(read.dofs.node)
    dofs = [
        item if item.direction == "modal" else replace(item, node=int(label[item.node % len(label)]))
        for item in structure.dofs
    ]
    return replace(structure, dofs=tuple(dofs))


def reduce_matrices_case(opened: OpenCase, run: RunContext, checked: bool = False) -> Answer:
    """Write the reduced model and the table of its full rows; with `checked`, check the fixed-interface modes.

    Raises
    ------
    CaseError
        See `reduce_matrices`.
    """
    assert run.output is not None
    result, read, free = reduce_matrices(opened, run)
    check, stem = None, opened.path.stem
    if checked:
        with located(opened.case, "structure", "boundary"):
            check = run.step("check of the modes").run(checked_matrices, free.linear, result.rom)
    files = [run.output / f"{stem}_rom.h5", run.output / f"{stem}_dofs.csv"]
    save_rom(result.rom, files[0])
    replace_file(files[1], _format_full_rows(read, free))
    return report_reduction(result, opened.case.structure.reduction.modes, check, files)


def _find_rows(case: Case[MatricesTable], read: ImportedMatrices) -> tuple[Rows, dict[str, Rows]]:
    """Find the rows that supports fix, and the rows that the reduction retains, by name."""
    mistakes = Mistakes(case)
    supported = [np.zeros(0, dtype=np.int64)]
    for number, support in enumerate(case.structure.support):
        with mistakes.at("structure", "support", number), at_key(case, "structure", "support", number, "nodes"):
            supported.append(read.dofs.rows(support.nodes, support.numbers))
    every = np.unique(np.concatenate(supported))
    retained: dict[str, Rows] = {}
    for number, table in enumerate(case.structure.boundary):
        with mistakes.at("structure", "boundary", number):
            with at_key(case, "structure", "boundary", number, "nodes"):
                rows = read.dofs.rows(table.nodes, table.numbers)
                fixed = np.intersect1d(rows, every)
                if len(fixed):
                    raise MatrixFileError(
                        f'"{table.name}" keeps {read.dofs.name(int(fixed[0]))}, which a support fixes: remove it from '
                        "one of the two"
                    )
            turning = read.dofs.direction[rows] >= N_TRANSLATION
            for name, own in ((table.name, rows[~turning]), (f"{table.name} rotation", rows[turning])):
                if name in retained:
                    with at_key(case, "structure", "boundary", number, "name"):
                        raise MatrixFileError(f'"{name}" is used twice: give each boundary a different name')
                if len(own):
                    retained[name] = own
    mistakes.raise_if_any()
    return every, retained


def _format_full_rows(read: ImportedMatrices, free: ImportedSystem) -> str:
    """Format node and direction of each row of the reduced model's recovery as CSV."""
    rows = np.flatnonzero(free.row >= 0)
    rows = rows[np.argsort(free.row[rows])]
    lines = [
        f"{number},{read.dofs.node[row]},{DIRECTIONS[read.dofs.direction[row]]}" for number, row in enumerate(rows)
    ]
    return "\n".join(["dof,node,direction", *lines, ""])


@contextmanager
def at_file(case: Case[MatricesTable], files: Mapping[str, Path]) -> Iterator[None]:
    """Locate an error of a reader at the key of the first file that its message names.

    Parameters
    ----------
    case
        Case with the files.
    files
        Files by their keys in `[structure.files]`.

    Raises
    ------
    CaseError
        In place of a `MatrixFileError` raised within the context.
    """
    try:
        yield
    except MatrixFileError as error:
        message = str(error)
        spoken = {key: message.find(f'"{file}"') for key, file in files.items()}
        result = [key for key in files if spoken[key] >= 0]
        if not result:
            with located(case, "structure", "files"):
                raise
        # If one file has several matrices, the key is that of the matrix in the message.
        first = min(result, key=lambda key: (spoken[key], f"the {key}" not in message))
        with at_key(case, "structure", "files", first):
            raise MatrixFileError(without_name(message, first, files[first])) from error


def without_name(message: str, key: str, file: Path) -> str:
    """Remove the name of the file from a message about it."""
    message = message.removeprefix(f"the {key}: ")
    missing = f'there is no file "{file}": check its name and folder'
    if message.startswith(missing):
        rest = message.removeprefix(missing)
        return f"there is no such file: check its name and folder, which are relative to the case file{rest}"
    for between in (": ", ", ", " "):
        if message.startswith(f'"{file}"{between}'):
            return message.removeprefix(f'"{file}"{between}')
    return message.replace(f'"{file}"', "this file", 1)
