"""Products with a sparse matrix that is the same in each direction, A kron I_3, as a consistent mass is.

Three degrees of freedom of k columns stand side by side in memory, so the matrix of the nodes, of a third of the
entries, does the work of all directions at once.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.mkl_product import MklProduct

Matrix = NDArray[np.float64]

DIRECTIONS = 3
#: Rows that change from one order of memory to the other while they are in the cache.
PIECE = 1024


class BlockProduct:
    """A symmetric sparse matrix, ready to be multiplied by many columns again and again.

    Parameters
    ----------
    matrix
        Shape (n, n); it is not needed afterwards.
    """

    def __init__(self, matrix: sp.csr_array) -> None:
        self.shape = matrix.shape
        node = node_matrix(matrix)
        self._direction, kept = (1, matrix) if node is None else (DIRECTIONS, node)
        try:
            self._kernel: MklProduct | SparseProduct = MklProduct(kept)
        except (ImportError, OSError, OverflowError):
            self._kernel = SparseProduct(kept)
        # Kept from one product to the next: fresh memory costs as much as the product.
        self._given = self._result = np.empty((0, 0))

    def __matmul__(self, columns: Matrix) -> Matrix:
        """Product with columns (n, k), in Fortran order."""
        n, k = columns.shape
        if self._given.shape != (n, k):
            self._given, self._result = np.empty((n, k)), np.empty((n, k))
        _copy(self._given, columns)
        wide = (n // self._direction, self._direction * k)
        self._kernel.into(self._result.reshape(wide), self._given.reshape(wide))
        product = np.empty((n, k), order="F")
        _copy(product, self._result)
        return product


class SparseProduct:
    """SciPy's product, where there is no MKL."""

    def __init__(self, matrix: sp.csr_array) -> None:
        self._matrix = matrix

    def into(self, result: Matrix, columns: Matrix) -> None:
        """As `MklProduct.into`."""
        result[...] = self._matrix @ columns


def _copy(target: Matrix, source: Matrix) -> None:
    for first in range(0, len(source), PIECE):
        target[first : first + PIECE] = source[first : first + PIECE]


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
