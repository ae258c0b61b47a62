"""Sparse matrices in ``.npz`` files of `scipy.sparse.save_npz`."""

from collections.abc import Mapping
from math import prod
from pathlib import Path

import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, check_real_matrix
from fe.file.npz_archive import read_npz, read_npz_headings
from fe.file.registry import FileFormat

#: Largest number of rows per stored number of a matrix.
_ROWS_PER_NUMBER = 8


def read_scipy_npz(path: Path) -> Mapping[str, FileMatrix]:
    """Read one real matrix.

    Raises
    ------
    MatrixFileError
        A complex matrix, or a file that is damaged or of another kind.
    """
    try:
        held = sum(prod(shape) for shape, _ in read_npz_headings(path).values())
        rows = [int(length) for length in read_npz(path, {"shape"})["shape"]]
        if max(rows) > _ROWS_PER_NUMBER * held:
            raise MatrixFileError(f'"{path}" announces {max(rows)} rows or columns, but holds {held} numbers')
        matrix = sp.load_npz(path)
        if hasattr(matrix, "check_format"):
            matrix.check_format(full_check=True)  # compiled code does not check indices
    except MatrixFileError:
        raise
    except Exception:  # many kinds of error, depending on the damaged byte
        raise MatrixFileError(f'"{path}" is not a sparse matrix: write it with scipy.sparse.save_npz') from None
    return {"": check_real_matrix(path, matrix)}


MATRIX_FORMATS.register(
    FileFormat(
        name="scipy_npz",
        suffixes=(".npz",),
        recognise=lambda head: head.startswith(b"PK"),
        read=read_scipy_npz,
        write=None,
    )
)
