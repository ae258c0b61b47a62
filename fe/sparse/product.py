"""Products of a sparse matrix with a few columns; sums over the entries of a row stay in registers."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

from fe.compiled import compiled
from fe.sparse.simd_code import SHORT_SIZE, SIZE, Buffer, groups
from fe.sparse.simd_sum import put_sparse_row

Matrix = NDArray[np.float64]

#: Number of nodes whose rows of a product are computed before they are copied to its columns.
PIECE = 64


class SparseProduct:
    """Product with a sparse matrix that is the same in each direction.

    Parameters
    ----------
    matrix
        Matrix of the nodes, shape (n_node, n_node); its arrays are not copied.
    direction
        Number of degrees of freedom of a node [-].
    """

    def __init__(self, matrix: sp.csr_array, direction: int) -> None:
        self._direction = direction
        self._start = np.asarray(matrix.indptr, dtype=np.int64)
        self._column = np.ascontiguousarray(matrix.indices, dtype=np.int32)
        self._values = np.ascontiguousarray(matrix.data, dtype=np.float64)
        self._buffer = Buffer()

    def multiply_into(self, product: Float[Matrix, "n k"], columns: Float[Matrix, "n k"]) -> None:
        """Store the product with columns in a matrix of their shape; both are in Fortran order."""
        matrix = self._start, self._column, self._values
        for some, lanes in groups(columns.shape[1]):
            rows = self._buffer.rows(len(columns), len(lanes))
            piece = np.empty((PIECE * self._direction, len(lanes)))
            # Transposed, they are in C order, even a single column: machine code is compiled for the order.
            _multiply(*matrix, columns[:, some].T, product[:, some].T, rows, piece, lanes, lanes * self._direction)


@compiled
def _multiply(
    start: Any, column: Any, values: Any, given: Any, result: Any, rows: Any, piece: Any, lanes: Any, wide: Any
) -> None:
    """Store the product; `wide` is as long as the rows of all directions of a node side by side."""
    n_column, n = given.shape
    direction = len(wide) // len(lanes)
    for first in range(0, n, len(piece)):
        some = min(len(piece), n - first)
        for k in range(n_column):
            for i in range(some):
                rows[first + i, k] = given[k, first + i]
        for k in range(n_column, len(lanes)):
            for i in range(some):
                rows[first + i, k] = 0.0
    x, out = rows.ctypes.data, piece.ctypes.data
    for first in range(0, n, len(piece)):
        some = min(len(piece), n - first)
        for i in range(some // direction):
            node = first // direction + i
            begin = start[node]
            entries, places = values.ctypes.data + SIZE * begin, column.ctypes.data + SHORT_SIZE * begin
            put_sparse_row(entries, places, start[node + 1] - begin, x, out + SIZE * len(wide) * i, 1, wide)
        for k in range(n_column):
            for i in range(some):
                result[k, first + i] = piece[i, k]
