"""What a file of another program says of a matrix."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.dof_table import DofLabels


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
    dofs: DofLabels | None = None


def real_matrix(path: Path, matrix: Any) -> FileMatrix:
    """A matrix of SciPy or NumPy that must be real.

    Raises
    ------
    MatrixFileError
        Another kind of numbers or of array.
    """
    if len(matrix.shape) != 2:
        raise MatrixFileError(f'"{path}" holds an array of shape {matrix.shape}: it must be a square matrix')
    if matrix.dtype.kind not in "fiub":
        kind = "complex numbers" if matrix.dtype.kind == "c" else f"{matrix.dtype}"
        raise MatrixFileError(f'"{path}" holds {kind}: give a real matrix, and losses as a damping matrix')
    return FileMatrix(matrix=sp.csr_array(matrix, dtype=np.float64))


def both_triangles(matrix: sp.csr_array) -> sp.csr_array:
    """A symmetric matrix from one of its triangles."""
    lower, upper = sp.tril(matrix, -1), sp.triu(matrix, 1)
    if lower.nnz and upper.nnz:
        # Some versions of ANSYS call a matrix symmetric and write both halves.
        return matrix
    return sp.csr_array(matrix + (lower + upper).T)
