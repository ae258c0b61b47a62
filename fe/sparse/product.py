"""Products of a sparse matrix with a few columns, whose sums stay in registers while the entries of a row pass by."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

from fe.compiled import compiled
from fe.sparse.simd_code import SHORT_SIZE, SIZE, Buffer, groups
from fe.sparse.simd_sum import put_sparse_row

Matrix = NDArray[np.float64]

#: Rows of a product that are found before they go to their columns.
PIECE = 64


class SparseProduct:
    """A sparse matrix, the same in each of some directions, ready to be multiplied.

    Parameters
    ----------
    matrix
        Matrix of the nodes, shape (n_node, n_node); its arrays are used where they are.
    direction
        Degrees of freedom of a node [-].
    """

    def __init__(self, matrix: sp.csr_array, direction: int) -> None:
        self._direction = direction
        self._start = np.asarray(matrix.indptr, dtype=np.int64)
        self._column = np.ascontiguousarray(matrix.indices, dtype=np.int32)
        self._values = np.ascontiguousarray(matrix.data, dtype=np.float64)
        self._buffer = Buffer()

    def multiply_into(self, product: Float[Matrix, "n k"], columns: Float[Matrix, "n k"]) -> None:
        """Put the product with columns into a matrix of their shape; both are in Fortran order."""
        matrix = self._start, self._column, self._values
        for some, lanes in groups(columns.shape[1]):
            rows = self._buffer.rows(len(columns), len(lanes))
            piece = np.empty((PIECE * self._direction, len(lanes)))
            # Turned, they are in the order of memory, even one column alone: machine code is made for the order.
            _multiply(*matrix, columns[:, some].T, product[:, some].T, rows, piece, lanes, lanes * self._direction)


@compiled
def _multiply(
    start: Any, column: Any, values: Any, given: Any, result: Any, rows: Any, piece: Any, lanes: Any, wide: Any
) -> None:
    """`wide` is as long as the rows of a node side by side, as many as the directions that it has."""
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
