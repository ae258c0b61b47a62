"""Products with a sparse matrix that is the same in each direction, A kron I_3, as a consistent mass is.

Three degrees of freedom of k columns stand side by side in memory, so the matrix of the nodes, of a third of the
entries, does the work of all directions at once.
"""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

DIRECTIONS = 3


def block_product(matrix: sp.csr_array) -> Callable[[Matrix], Matrix]:
    """A function that multiplies the matrix (n, n) by columns (n, k); its results are in Fortran order."""
    node = node_matrix(matrix)
    if node is None:
        return lambda columns: np.asfortranarray(matrix @ columns)
    n = matrix.shape[0]

    def product(columns: Matrix) -> Matrix:
        side_by_side = np.ascontiguousarray(columns).reshape(node.shape[0], -1)
        return np.asfortranarray((node @ side_by_side).reshape(n, -1))

    return product


def node_matrix(matrix: sp.csr_array) -> sp.csr_array | None:
    """A of a matrix A kron I_3, shape (n / 3, n / 3); None of any other matrix."""
    n = matrix.shape[0]
    length = np.diff(matrix.indptr)
    if n % DIRECTIONS or (length.reshape(-1, DIRECTIONS) != length[::DIRECTIONS, None]).any():
        return None
    direction = np.repeat(np.arange(n) % DIRECTIONS, length)
    first = direction == 0
    column, values = matrix.indices[first], matrix.data[first]
    if (column % DIRECTIONS).any():
        return None
    for d in range(1, DIRECTIONS):
        other = direction == d
        if (matrix.indices[other] != column + d).any() or (matrix.data[other] != values).any():
            return None
    start = np.concatenate([[0], np.cumsum(length[::DIRECTIONS])])
    size = n // DIRECTIONS
    return sp.csr_array((values, column // DIRECTIONS, start), shape=(size, size))
