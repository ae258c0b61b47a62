"""Sparse matrices in ``.npz`` files of `scipy.sparse.save_npz`."""

from collections.abc import Mapping
from pathlib import Path

import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, real_matrix
from fe.file.registry import FileFormat


def read_scipy_npz(path: Path) -> Mapping[str, FileMatrix]:
    """Read one real matrix.

    Raises
    ------
    MatrixFileError
        A complex matrix, or a file that is damaged or of another kind.
    """
    try:
        matrix = sp.load_npz(path)
    except Exception:  # a dozen kinds, depending on which byte is damaged
        raise MatrixFileError(f'"{path}" is no sparse matrix: write it with scipy.sparse.save_npz') from None
    return {"": real_matrix(path, matrix)}


MATRIX_FORMATS.register(
    FileFormat(
        name="scipy_npz",
        suffixes=(".npz",),
        recognise=lambda head: head.startswith(b"PK"),
        read=read_scipy_npz,
        write=None,
    )
)
