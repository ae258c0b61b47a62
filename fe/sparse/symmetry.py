"""Check that a matrix is symmetric; factorisations would silently use one triangle of any other matrix."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.sparse.factor import Symmetric
from fe.sparse.node_matrix import NodeMatrix
from fe.sparse.symmetric_part import PartView

#: Largest difference of two mirrored entries, relative to the largest entries of their rows, that is accepted as
#: round-off.
ROUND_OFF = 1e-10


def check_symmetric(matrix: Symmetric) -> None:
    """Refuse a sparse matrix that is not real, finite, square and symmetric.

    The products of the matrix and of its transpose with random numbers are compared, with rows scaled by their largest
    entries. For a part, the whole matrix is checked; matrices of which one triangle is stored are not checked.

    Parameters
    ----------
    matrix
        Matrix, shape (n, n).

    Raises
    ------
    ValueError
        The matrix is not sparse, complex, empty, not square, not finite or not symmetric; for the last two the message
        names a row.
    """
    while isinstance(matrix, PartView):
        matrix = matrix.matrix
    given = matrix.nodes if isinstance(matrix, NodeMatrix) else matrix
    if not hasattr(given, "tocsr"):
        raise ValueError(f"{type(given).__name__} is not a sparse matrix: give scipy.sparse.csr_array of it")
    if not sp.issparse(given):
        return
    whole: Any = given
    if whole.dtype.kind == "c":
        raise ValueError("the matrix is complex: factorise a real one, and give losses as a damping matrix")
    if len(whole.shape) != 2 or whole.shape[0] != whole.shape[1] or not whole.shape[0]:
        raise ValueError(f"the matrix has shape {whole.shape}: it must be square and not empty")
    stored = sp.csr_array(whole)
    largest = _find_largest(stored)
    if not np.isfinite(largest).all():
        row = int(np.argmin(np.isfinite(largest)))
        raise ValueError(f"the matrix contains a value that is not finite in row {row}, counted from 0")
    scale = 1 / np.sqrt(np.where(largest > 0, largest, 1.0))
    # No random number is small, so that every entry contributes.
    random = np.random.default_rng(0).uniform(1, 2, len(scale)) * scale
    difference = np.abs(stored @ random - random @ stored) * scale
    if (difference > ROUND_OFF).any():
        row = int(difference.argmax())
        raise ValueError(
            f"the matrix is not symmetric, most clearly in row {row}, counted from 0: give both triangles, without "
            "follower forces or gyroscopic terms"
        )


def _find_largest(matrix: sp.csr_array) -> NDArray[np.float64]:
    """Magnitude of the largest entry of each row, shape (n,)."""
    filled = np.flatnonzero(np.diff(matrix.indptr))
    largest = np.zeros(matrix.shape[0])
    if len(filled):
        start, values = matrix.indptr[filled], np.asarray(matrix.data, dtype=float)
        largest[filled] = np.maximum(np.maximum.reduceat(values, start), -np.minimum.reduceat(values, start))
    return largest
