"""One sparse matrix from a file of another program; the ending says which."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.dof_table import LARGEST_LABEL, DofTable
from fe.file.matrix.dmig import read_dmig
from fe.file.matrix.harwell_boeing import read_harwell_boeing, whole
from fe.file.matrix.output4 import read_output4


@dataclass(frozen=True, kw_only=True)
class MatrixSource:
    """Where a matrix stands.

    Parameters
    ----------
    file
        ``.mtx``, ``.mmf`` (MatrixMarket, ANSYS' ``*EXPORT,name,MMF``), ``.hb``, ``.rb``, ``.matrix`` (Harwell-Boeing,
        ANSYS' HBMAT), ``.op4`` (Nastran's OUTPUT4), ``.pch``, ``.bdf``, ``.dat`` (Nastran's DMIG cards), ``.sti``,
        ``.mas`` (CalculiX' ``SOLVER=MATRIXSTORAGE``) or ``.npz`` (`scipy.sparse.save_npz`).
    name
        In a file of several matrices, which one; empty for the only one.
    """

    file: Path
    name: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class FileMatrix:
    """What a file holds.

    Parameters
    ----------
    matrix
        Shape (n, n), both halves of a symmetric one.
    dofs
        Which degree of freedom each row is; None where the file does not say.
    """

    matrix: sp.csr_array
    dofs: DofTable | None = None


def read_matrix(source: MatrixSource) -> FileMatrix:
    """Read one matrix.

    Raises
    ------
    MatrixFileError
        A file that is missing, damaged or of another kind, a name that it does not hold, or a matrix that is not
        square, not real or not finite.
    """
    path = source.file
    require_file(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(_READERS)
        raise MatrixFileError(f'"{path}" ends in "{path.suffix}": give a matrix as one of {known}')
    if source.name and reader not in {_output4, _dmig}:
        raise MatrixFileError(f'"{path}" holds one matrix without a name: remove the name "{source.name}"')
    found = reader(source)
    _check(path, found)
    return found


def require_file(path: Path) -> None:
    """Refuse a file that is not there.

    Raises
    ------
    MatrixFileError
        Nothing of that name, or a folder.
    """
    if path.is_dir():
        raise MatrixFileError(f'"{path}" is a folder: name a file in it')
    if not path.is_file():
        raise MatrixFileError(f'there is no file "{path}": check its name and folder')


def _check(path: Path, found: FileMatrix) -> None:
    matrix = found.matrix
    if matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
        raise MatrixFileError(
            f'"{path}" holds a matrix of {matrix.shape[0]} x {matrix.shape[1]}: it must be square and not empty, '
            "with a row and a column for each degree of freedom: write it again"
        )
    bad = np.flatnonzero(~np.isfinite(matrix.data))
    if len(bad):
        row = int(np.searchsorted(matrix.indptr, bad[0], side="right")) - 1
        raise MatrixFileError(
            f'"{path}" holds {matrix.data[bad[0]]} in row {row}, column {matrix.indices[bad[0]]} (from 0): write it '
            "again with finite numbers"
        )


def _real(path: Path, matrix: Any) -> FileMatrix:
    if len(matrix.shape) != 2:
        raise MatrixFileError(f'"{path}" holds an array of shape {matrix.shape}: it must be a square matrix')
    if matrix.dtype.kind not in "fiub":
        kind = "complex numbers" if matrix.dtype.kind == "c" else f"{matrix.dtype}"
        raise MatrixFileError(f'"{path}" holds {kind}: give a real matrix, and losses as a damping matrix')
    return FileMatrix(matrix=sp.csr_array(matrix, dtype=np.float64))


def _matrix_market(source: MatrixSource) -> FileMatrix:
    from scipy.io import mminfo, mmread

    try:
        field = mminfo(source.file)[4]
        matrix = mmread(source.file)
    except (ValueError, OSError, OverflowError, EOFError) as error:
        raise MatrixFileError(
            f'"{source.file}" is no MatrixMarket file, or damaged ({error}): write it again'
        ) from None
    if field == "pattern":
        raise MatrixFileError(f'"{source.file}" holds places without values (pattern): write it as real')
    return _real(source.file, matrix)


def _npz(source: MatrixSource) -> FileMatrix:
    try:
        matrix = sp.load_npz(source.file)
    except Exception:  # a dozen kinds, depending on which byte is damaged
        raise MatrixFileError(f'"{source.file}" is no sparse matrix: write it with scipy.sparse.save_npz') from None
    return _real(source.file, matrix)


def _triplets(source: MatrixSource) -> FileMatrix:
    """One triangle as lines of row, column (from 1) and value."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of NumPy, of an empty file, which is refused below
            table = np.loadtxt(source.file, dtype=np.float64, ndmin=2)
        place = table[:, :2]
        # Read as real numbers: what is no row is nan, 1.7, 0 or too large.
        if table.shape[1] != 3 or not ((place % 1 == 0) & (place >= 1) & (place <= LARGEST_LABEL)).all():
            raise ValueError
        rows, columns = place.T.astype(np.int64) - 1
    except (ValueError, LookupError):
        raise MatrixFileError(
            f'"{source.file}" is no CalculiX matrix, or damaged: write it with *FREQUENCY, SOLVER=MATRIXSTORAGE'
        ) from None
    size = int(max(rows.max(), columns.max())) + 1
    matrix = sp.csr_array(sp.coo_array((table[:, 2], (rows, columns)), shape=(size, size)))
    return FileMatrix(matrix=whole(matrix))


def _harwell_boeing(source: MatrixSource) -> FileMatrix:
    return FileMatrix(matrix=read_harwell_boeing(source.file))


def _output4(source: MatrixSource) -> FileMatrix:
    return FileMatrix(matrix=_named(source, read_output4(source.file)))


def _dmig(source: MatrixSource) -> FileMatrix:
    matrix, dofs = _named(source, read_dmig(source.file))
    return FileMatrix(matrix=matrix, dofs=dofs)


def _named(source: MatrixSource, found: Mapping[str, Any]) -> Any:
    if not found:
        raise MatrixFileError(f'"{source.file}" holds no matrix: write it again')
    if source.name in found:
        return found[source.name]
    if len(found) == 1 and not source.name:
        return next(iter(found.values()))
    wanted = f'no matrix "{source.name}"' if source.name else "several matrices"
    raise MatrixFileError(f'"{source.file}" holds {wanted}: name one of {", ".join(found)}')


_READERS: Mapping[str, Callable[[MatrixSource], FileMatrix]] = {
    ".mtx": _matrix_market,
    ".mmf": _matrix_market,
    ".hb": _harwell_boeing,
    ".rb": _harwell_boeing,
    ".matrix": _harwell_boeing,
    ".op4": _output4,
    ".pch": _dmig,
    ".bdf": _dmig,
    ".dat": _dmig,
    ".sti": _triplets,
    ".mas": _triplets,
    ".npz": _npz,
}
