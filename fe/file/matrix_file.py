"""Read one sparse matrix from a file of another program; suffix and content give the format."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe.errors import MatrixFileError
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix
from fe.file.registry import format_of, suffixes


@dataclass(frozen=True, kw_only=True)
class MatrixSource:
    """File of a matrix, and its name in the file.

    Parameters
    ----------
    file
        File of one of the formats in `fe.file.matrix`: MatrixMarket, Harwell-Boeing, Nastran's OUTPUT4 and DMIG cards,
        CalculiX, Abaqus, sparse ``.npz``.
    name
        Name of the matrix in a file of several matrices; empty for the only matrix of a file.
    """

    file: Path
    name: str = ""


def read_matrix(source: MatrixSource) -> FileMatrix:
    """Read one matrix.

    Raises
    ------
    MatrixFileError
        A file that is missing, damaged or of another kind, a matrix name that is not in the file, or a matrix that is
        not square, not real or not finite.
    """
    path = source.file
    require_file(path)
    known = suffixes(MATRIX_FORMATS)
    if path.suffix.lower() not in known:
        raise MatrixFileError(f'"{path}" ends in "{path.suffix}": give a matrix as one of {", ".join(known)}')
    matrices = format_of(MATRIX_FORMATS, path).read(path)
    if source.name and {*matrices} == {""}:
        raise MatrixFileError(f'"{path}" holds one matrix without a name: remove the name "{source.name}"')
    result = matrices[source.name] if source.name in matrices else next(iter(matrices.values()), None)
    if result is None:
        raise MatrixFileError(f'"{path}" holds no matrix: write it again')
    if source.name not in matrices and (source.name or len(matrices) > 1):
        wanted = f'no matrix "{source.name}"' if source.name else "several matrices"
        raise MatrixFileError(f'"{path}" holds {wanted}: name one of {", ".join(matrices)}')
    _check(path, result)
    return result


def require_file(path: Path) -> None:
    """Refuse a path that is not an existing file.

    Raises
    ------
    MatrixFileError
        A missing file, or a folder.
    """
    if path.is_dir():
        raise MatrixFileError(f'"{path}" is a folder: name a file in it')
    if not path.is_file():
        raise MatrixFileError(f'there is no file "{path}": check its name and folder')


def _check(path: Path, file_matrix: FileMatrix) -> None:
    matrix = file_matrix.matrix
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
