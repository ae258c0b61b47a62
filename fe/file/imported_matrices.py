"""Mass, damping and stiffness matrices of another program, checked and converted to a linear system."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int
from numpy.typing import NDArray

from fe.errors import MatrixFileError
from fe.file.dof_table import N_TRANSLATION, DofLabels, numbered, read_dof_table
from fe.file.matrix_content import FileMatrix
from fe.file.matrix_file import MatrixSource, read_matrix
from fe.sparse.definiteness import is_definite
from fe.system import LinearSystem

#: Largest asymmetry, relative to the largest entry, that is accepted as round-off of written numbers.
ASYMMETRY = 1e-8
#: Negative stiffness, relative to the diagonal, that rigid motions of a free structure may have when the numbers were
#: written in single precision.
SINGLE_PRECISION_SLACK = 1e-6

Rows = Int[NDArray[np.int64], " k"]


class Units(Enum):
    """Unit systems of programs; the value is the unit of length in metres. Forces are in newtons in all systems."""

    SI = 1.0
    """m, kg, N, s"""
    MILLIMETRE = 1e-3
    """mm, tonne, N, s"""


@dataclass(frozen=True, kw_only=True, eq=False)
class ImportedMatrices:
    """Symmetric matrices in SI units, with the degree of freedom of each row.

    Parameters
    ----------
    mass, damping, stiffness
        Sparse matrices, both triangles, shape (n, n) [kg, N s/m, N/m, and with rotations kg m^2 and so on].
    dofs
        Node and direction of each row.
    """

    mass: sp.csr_array
    damping: sp.csr_array
    stiffness: sp.csr_array
    dofs: DofLabels

    def system(self, fixed: Rows) -> "ImportedSystem":
        """Linear system of the matrices on the degrees of freedom that the supports leave free.

        Parameters
        ----------
        fixed
            Rows that supports fix, shape (k,) [-].

        Raises
        ------
        MatrixFileError
            No free degree of freedom, a degree of freedom without stiffness or mass or with a negative diagonal entry,
            a mass that is not positive definite, or a stiffness that is indefinite.
        """
        label, place = np.unique(self.dofs.node, return_inverse=True)
        turning = self.dofs.direction >= N_TRANSLATION
        # A linear system has three directions per node: rotations get separate nodes after all nodes of translations.
        mesh_dof = N_TRANSLATION * (place + len(label) * turning) + self.dofs.direction % N_TRANSLATION
        free = np.setdiff1d(np.arange(self.dofs.n_dof), fixed)
        if not len(free):
            raise MatrixFileError("the supports fix every degree of freedom of the matrices: leave some free")
        free = free[np.argsort(mesh_dof[free])]
        self._check_carried(free)
        matrices = {name: getattr(self, name)[free][:, free] for name in ("mass", "damping", "stiffness")}
        _check_definite(matrices["mass"], matrices["stiffness"])
        linear = LinearSystem(**matrices, free=mesh_dof[free], n_node=len(label) * (2 if turning.any() else 1))
        row = np.full(self.dofs.n_dof, -1)
        row[free] = np.arange(len(free))
        return ImportedSystem(linear=linear, row=row)

    def _check_carried(self, free: Rows) -> None:
        for name in ("mass", "stiffness"):
            diagonal = getattr(self, name).diagonal()
            worst = int(free[diagonal[free].argmin()])
            if diagonal[worst] < 0:
                raise MatrixFileError(
                    f"{self.dofs.name(worst)} has a {name} of {diagonal[worst]:g} on the diagonal: check its sign"
                )
        no_stiffness = free[np.asarray(abs(self.stiffness).sum(axis=1)).ravel()[free] == 0]
        if len(no_stiffness):
            raise MatrixFileError(
                f"{self._named(no_stiffness)} no stiffness: fix unused degrees of freedom by a support, as AUTOSPC does"
            )
        light = free[self.mass.diagonal()[free] <= 0]
        if len(light):
            raise MatrixFileError(
                f"{self._named(light)} no mass: write a consistent mass matrix (Nastran: PARAM,COUPMASS,1; ANSYS: "
                "LUMPM,OFF), or fix it by a support"
            )

    def _named(self, rows: Rows) -> str:
        others = f" and {len(rows) - 1} others have" if len(rows) > 1 else " has"
        return f"{self.dofs.name(int(rows[0]))}{others}"


@dataclass(frozen=True, kw_only=True, eq=False)
class ImportedSystem:
    """Imported matrices on their free degrees of freedom.

    Parameters
    ----------
    linear
        Linear system; its node k is the k-th label in ascending order, and rotations follow on separate nodes.
    row
        Row of the linear system for each row of the files, -1 where it is fixed, shape (n,) [-].
    """

    linear: LinearSystem
    row: Rows


def read_matrices(
    mass: MatrixSource,
    stiffness: MatrixSource,
    *,
    damping: MatrixSource | None = None,
    dofs: Path | None = None,
    units: Units = Units.SI,
) -> ImportedMatrices:
    """Read mass, stiffness and damping matrices of another program.

    Parameters
    ----------
    mass, stiffness, damping
        Sources of the matrices; the damping is zero without a source.
    dofs
        File for `fe.file.dof_table.read_dof_table`. Without it, row k is node k in direction x, counted from 0; DMIG
        cards and files of Abaqus contain their degrees of freedom.
    units
        Units of the files.

    Raises
    ------
    MatrixFileError
        A file that cannot be read, matrices or a table of different sizes, or a matrix that is not symmetric.
    """
    sources = {"mass": mass, "stiffness": stiffness} | ({} if damping is None else {"damping": damping})
    result = {name: _read(name, source) for name, source in sources.items()}
    matrices, table = _put_on_one_table(sources, result, dofs)
    for name, matrix in matrices.items():
        _check_symmetric(sources[name].file, name, matrix, table)
        matrices[name] = _convert_to_si(sp.csr_array((matrix + matrix.T) / 2), table, units)
    if "damping" not in matrices:
        matrices["damping"] = sp.csr_array(matrices["mass"].shape)
    return ImportedMatrices(**matrices, dofs=table)


def _read(name: str, source: MatrixSource) -> FileMatrix:
    try:
        return read_matrix(source)
    except MatrixFileError as error:
        raise MatrixFileError(f"the {name}: {error}") from error


def _put_on_one_table(
    sources: dict[str, MatrixSource], matrices: dict[str, FileMatrix], dofs: Path | None
) -> tuple[dict[str, sp.csr_array], DofLabels]:
    named = {name: item.dofs for name, item in matrices.items() if item.dofs is not None}
    if named and (len(named) < len(matrices) or dofs is not None):
        raise MatrixFileError(
            f'"{sources[next(iter(named))].file}" contains its own table of degrees of freedom: give all matrices as '
            "DMIG cards or files of Abaqus, without a separate table"
        )
    if named:
        return _unite(matrices, list(named.values()))
    size = {name: item.matrix.shape[0] for name, item in matrices.items()}
    table = numbered(size["stiffness"]) if dofs is None else read_dof_table(dofs)
    other = [name for name in matrices if size[name] != table.n_dof]
    if len(other) == len(matrices) and len(set(size.values())) == 1:
        raise MatrixFileError(
            f'"{dofs}" lists {table.n_dof} degrees of freedom, but the matrices have {size["stiffness"]} rows: write '
            "one line for each row, all from the same model"
        )
    if other:
        # Only a table can tell which of two matrices is wrong.
        reference = f'the stiffness of "{sources["stiffness"].file}"' if dofs is None else f'"{dofs}"'
        kind = "rows" if dofs is None else "degrees of freedom"
        raise MatrixFileError(
            f'"{sources[other[0]].file}": the {other[0]} has {size[other[0]]} rows, but {reference} has {table.n_dof} '
            f"{kind}: write both from the same model"
        )
    return {name: item.matrix for name, item in matrices.items()}, table


def _unite(imported: dict[str, FileMatrix], tables: Sequence[DofLabels]) -> tuple[dict[str, sp.csr_array], DofLabels]:
    """Matrices on the union of their degrees of freedom, because cards omit rows of zeros."""
    pairs = np.unique(np.concatenate([np.stack([item.node, item.direction], axis=1) for item in tables]), axis=0)
    table = DofLabels(node=pairs[:, 0], direction=pairs[:, 1])
    matrices = {}
    for name, item in imported.items():
        assert item.dofs is not None
        place = np.searchsorted(table.key, item.dofs.key)
        entries = sp.coo_array(item.matrix)
        spread = (entries.data, (place[entries.row], place[entries.col]))
        matrices[name] = sp.csr_array(sp.coo_array(spread, shape=(table.n_dof,) * 2))
    return matrices, table


def _check_symmetric(file: Path, name: str, matrix: sp.csr_array, table: DofLabels) -> None:
    skew = sp.coo_array(matrix - matrix.T)
    if not skew.nnz or np.abs(skew.data).max() <= ASYMMETRY * np.abs(matrix.data).max():
        return
    worst = int(np.abs(skew.data).argmax())
    i, j = sorted((int(skew.row[worst]), int(skew.col[worst])))
    if not (sp.triu(matrix, 1).nnz and sp.tril(matrix, -1).nnz):
        raise MatrixFileError(
            f'"{file}": the {name} contains only one triangle and is not marked as symmetric: write both triangles, '
            "or use a format that marks symmetry, such as the symmetric one of MatrixMarket"
        )
    remedy = "write it again" if name == "mass" else "write it without follower forces and gyroscopic terms"
    raise MatrixFileError(
        f'"{file}": the {name} is not symmetric, worst between {table.name(i)} and {table.name(j)}: entries ({i}, {j}) '
        f"and ({j}, {i}), counted from 0, are {matrix[i, j]:g} and {matrix[j, i]:g}; {remedy}"
    )


def _check_definite(mass: sp.csr_array, stiffness: sp.csr_array) -> None:
    if not is_definite(mass, 0.0):
        raise MatrixFileError(
            "the mass is not positive definite: a motion has no mass, or a negative one; check signs and units of the "
            "mass, and write a consistent one"
        )
    if not is_definite(stiffness, SINGLE_PRECISION_SLACK):
        raise MatrixFileError(
            "the stiffness is indefinite, so a motion meets a negative restoring force: check its signs and units, "
            "and write it without preload beyond buckling"
        )


def _convert_to_si(matrix: sp.csr_array, table: DofLabels, units: Units) -> sp.csr_array:
    """Matrix in SI units; its quadratic form in the file's unit of length is an energy in newtons times that unit."""
    length = units.value
    per_metre = np.where(table.direction < N_TRANSLATION, 1 / length, 1.0)
    scale = sp.diags_array(per_metre)
    return sp.csr_array(length * (scale @ matrix @ scale))
