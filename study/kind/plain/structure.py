"""A plain structure from its file: matrices, named parts, degrees of freedom, rows and damping."""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from casefile.errors import CaseError
from casefile.table import Mistakes
from correlation.errors import ModelDefinitionError
from correlation.model import DIRECTIONS, Dof, StructurePart
from fe.file.npz_archive import NpzError, read_npz
from geometry.errors import InputError
from reduction.errors import JointError, MatrixError
from reduction.file.structure_file import NAMES, StructureMatrices, load_matrices
from reduction.jointed_system import Joint
from reduction.stuck import stick_at_rest, stuck_damping
from study.case.structure import Structure, list_reduced_dofs
from study.case.tables import Case
from study.kind.plain.table import DofTable, PlainTable, RayleighTable

Matrix = Float[NDArray[np.float64], "r r"]

#: Arrays that describe the degrees of freedom, with one entry per degree of freedom.
DOF_ARRAYS = ("dof_body", "dof_node", "dof_direction", "dof_coordinates")
#: Largest relative difference between a matrix and the sum of its parts that counts as round-off [-].
ROUND_OFF = 1e-9


def read_plain_structure(case: Case[PlainTable], folder: Path) -> Structure:
    """Read the structure of a case.

    Parameters
    ----------
    case
        Case of plain matrices.
    folder
        Folder of the file: ``.npz``, ``.mat`` or ``.h5``; an ``.npz`` file may also have parts, degrees of freedom and
        rows.

    Raises
    ------
    CaseError
        The file cannot be used, its parts do not add up, or tables and arrays differ in length from the matrices.
    """
    table, mistakes, result = case.structure, Mistakes(case), None
    with mistakes.at("structure"):
        result = _read(folder / table.file, table.dof)
    if result is None:
        raise CaseError(mistakes.problems)
    if table.damping is None:
        return result
    return Structure(
        matrices=result.matrices,
        dofs=result.dofs,
        parts=result.parts,
        stored=result.stored,
        loss_factor=table.damping.loss_factor,
        damped=None
        if not table.damping.is_rayleigh
        else partial(make_rayleigh_damping, table.damping, result.matrices),
    )


def _read(file: Path, tables: Sequence[DofTable]) -> Structure:
    try:
        matrices = load_matrices(file)
        arrays = _read_arrays(file) if file.suffix.lower() == ".npz" else {}
        parts = _make_parts(matrices, arrays)
        dofs = _make_dofs_of_arrays(arrays, matrices.n_dof) or _make_dofs_of_rom(matrices)
    except InputError as error:
        # The message names the key "file", so that it gets the line of this key.
        raise MatrixError(f"the file cannot be used: {error}") from error
    r = matrices.n_dof
    if tables and len(tables) != r:
        raise ModelDefinitionError(
            f"{len(tables)} tables [[structure.dof]] for {r} degrees of freedom: write one for each"
        )
    stored = {
        name: np.asarray(array, dtype=np.float64)
        for name, array in arrays.items()
        if array.dtype.kind in "fiu" and array.ndim in {1, 2} and array.shape[-1] == r and not _is_matrix(name)
    }
    return Structure(
        matrices=matrices, parts=parts, dofs=tuple(map(_make_dof, tables)) if tables else dofs, stored=stored
    )


def _read_arrays(file: Path) -> Mapping[str, NDArray[np.generic]]:
    try:
        return read_npz(file)
    except NpzError as error:
        raise MatrixError(f'"{file}" is damaged: {error}; write it again with np.savez') from None


def _is_matrix(name: str) -> bool:
    return name in {item for group in NAMES.values() for item in group} or name.startswith(("part_", "dof_"))


def _make_parts(matrices: StructureMatrices, arrays: Mapping[str, NDArray[np.generic]]) -> tuple[StructurePart, ...]:
    """Make the named parts; a missing mass or stiffness of a part is zero."""
    names = list(
        dict.fromkeys(named[1] for name in arrays if (named := re.fullmatch(r"part_(.+)_(mass|stiffness)", name)))
    )
    zero = np.zeros_like(matrices.mass)
    result: dict[str, list[Matrix]] = {"mass": [], "stiffness": []}
    for kind, shares in result.items():
        for name in names:
            share = np.asarray(arrays.get(f"part_{name}_{kind}", zero), dtype=np.float64)
            if share.shape != zero.shape:
                raise MatrixError(
                    f"part_{name}_{kind} has shape {share.shape}, the {kind} {zero.shape}: make the shapes equal"
                )
            shares.append(share)
        whole = getattr(matrices, kind)
        if names and not np.abs(np.sum(shares, axis=0) - whole).max() <= ROUND_OFF * np.abs(whole).max():
            raise MatrixError(f"the parts {', '.join(names)} do not add up to the {kind}: store all parts, or none")
    return tuple(
        StructurePart(name=name, mass=mass, stiffness=stiffness)
        for name, mass, stiffness in zip(names, result["mass"], result["stiffness"], strict=True)
    )


def _make_dofs_of_arrays(arrays: Mapping[str, NDArray[np.generic]], r: int) -> tuple[Dof, ...]:
    given = {name: arrays[name] for name in DOF_ARRAYS if name in arrays}
    for name, array in given.items():
        wanted = (r, 3) if name == "dof_coordinates" else (r,)
        if array.shape != wanted:
            raise ModelDefinitionError(
                f"{name} has shape {array.shape}: give {wanted}, one entry per degree of freedom"
            )
    if "dof_direction" not in given:
        return ()
    directions = [str(item) for item in given["dof_direction"]]
    for number, direction in enumerate(directions):
        if direction not in DIRECTIONS:
            raise ModelDefinitionError(f'dof_direction[{number}] is "{direction}": give one of {", ".join(DIRECTIONS)}')
    bodies = given.get("dof_body", np.full(r, "structure"))
    nodes = np.asarray(given.get("dof_node", np.arange(r)), dtype=np.int64)
    coordinates = np.asarray(given.get("dof_coordinates", np.full((r, 3), np.nan)), dtype=np.float64)
    return tuple(
        Dof(
            body=str(body),
            node=int(node),
            direction=direction,
            coordinates=at if np.isfinite(at).all() else None,
        )
        for body, node, direction, at in zip(bodies, nodes, directions, coordinates, strict=True)
    )


def _make_dofs_of_rom(matrices: StructureMatrices) -> tuple[Dof, ...]:
    return () if matrices.rom is None else list_reduced_dofs(matrices.rom)


def _make_dof(table: DofTable) -> Dof:
    at = None if table.coordinates is None else np.array(table.coordinates)
    return Dof(body=table.body, node=table.node, direction=table.direction, coordinates=at)


def make_rayleigh_damping(table: RayleighTable, matrices: StructureMatrices, joints: Sequence[Joint]) -> Matrix:
    """C = alpha M + beta K [N s/m].

    Parameters
    ----------
    table
        Factors, or the damping ratio of the first mode with all contacts stuck.
    matrices
        Matrices of the structure.
    joints
        All joints of the structure.

    Raises
    ------
    JointError
        The file has a damping matrix, and the table does not replace it.
    """
    if matrices.has_damping and not table.replace:
        says = "" if table.ratio is None else f"ratio = {table.ratio:g}: "
        raise JointError(
            f"{says}the file of the structure already contains damping: add replace = true to replace it, or remove "
            "[structure.damping]"
        )
    mass, stiffness = matrices.mass, matrices.stiffness
    if table.ratio is not None:
        return stuck_damping(mass, stiffness, stick_at_rest(stiffness, joints), table.ratio)
    return np.asarray((table.mass_factor or 0.0) * mass + (table.stiffness_factor or 0.0) * stiffness)
