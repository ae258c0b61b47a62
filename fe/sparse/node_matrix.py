"""Sparse matrix that is the same in each direction, A kron I_3, such as a consistent mass, and products with it.

The three degrees of freedom of a node, for k columns, are side by side in memory, so that A, with a third of the
entries, is multiplied by all directions at once.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.sparse.factor import LONG, NODE, Symmetric, check_rows

if TYPE_CHECKING:
    from fe.sparse.product import SparseProduct

Matrix = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class NodeMatrix:
    """Matrix A kron I_3, of which only A is stored: a third of the entries.

    Parameters
    ----------
    nodes
        Matrix A, symmetric, both triangles, shape (n_node, n_node).
    """

    nodes: sp.csr_array

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the whole matrix."""
        n = NODE * self.nodes.shape[0]
        return n, n

    def __matmul__(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Product with a vector (n,) or columns (n, k).

        Raises
        ------
        ValueError
            A number of rows that does not match the matrix.
        """
        check_rows(self.shape, columns)
        n_node = self.nodes.shape[0]
        return np.asarray(self.nodes @ columns.reshape(n_node, columns.size // n_node)).reshape(columns.shape)

    def diagonal(self) -> Float[NDArray[np.float64], " n"]:
        """Diagonal, shape (n,)."""
        return np.repeat(self.nodes.diagonal(), NODE)

    def part(self, nodes: Int[NDArray[np.int64], " m"]) -> "NodeMatrix":
        """Copy of the rows and columns of some nodes."""
        return NodeMatrix(nodes=sp.csr_array(self.nodes[nodes][:, nodes]))

    def tocsr(self) -> sp.csr_array:
        """Whole matrix A kron I_3 as CSR, shape (n, n)."""
        row_start, n = self.nodes.indptr, self.shape[0]
        length = np.repeat(np.diff(row_start), NODE)
        start = np.concatenate([[0], np.cumsum(length)]).astype(np.int32)
        ahead = start[:-1] - np.repeat(row_start[:-1], NODE)
        source = np.arange(start[-1], dtype=np.int32) - np.repeat(ahead, length)
        direction = np.repeat(np.arange(n, dtype=np.int32) % NODE, length)
        column = NODE * self.nodes.indices[source] + direction
        return sp.csr_array((self.nodes.data[source], column, start), shape=self.shape)

    def toarray(self) -> Float[NDArray[np.float64], "n n"]:
        """All entries, shape (n, n)."""
        return np.asarray(self.tocsr().toarray())


class BlockProduct:
    """Product with a symmetric sparse matrix, prepared for many products with many columns.

    Parameters
    ----------
    matrix
        Matrix, shape (n, n); it is not needed afterwards.
    """

    def __init__(self, matrix: Symmetric) -> None:
        self.shape = (matrix.shape[0], matrix.shape[1])
        if isinstance(matrix, NodeMatrix):
            direction, kept = NODE, matrix.nodes
        else:
            whole = matrix.tocsr()
            node = node_matrix(whole)
            direction, kept = (1, whole) if node is None else (NODE, node)
        self._kernel = _choose_kernel(kept, direction)
        # Kept between products, because allocating memory costs as much as the product.
        self._workspace = np.empty((0, 0))

    def __matmul__(self, columns: Matrix) -> Matrix:
        """Product with columns (n, k), in Fortran order."""
        return self.multiply_into(np.empty(columns.shape, order="F"), columns)

    def multiply_in_workspace(self, columns: Matrix) -> Matrix:
        """Product with columns in a workspace, which the next call overwrites."""
        if self._workspace.shape != columns.shape:
            self._workspace = np.empty(columns.shape, order="F")
        return self.multiply_into(self._workspace, columns)

    def multiply_into(self, product: Matrix, columns: Matrix) -> Matrix:
        """Product with columns in a given array of the columns' shape in Fortran order.

        Raises
        ------
        ValueError
            Columns with a number of rows that does not match the matrix, complex columns, an array without two
            dimensions, or a product of another shape.
        """
        check_rows(self.shape, columns)
        if columns.ndim != 2 or product.shape != columns.shape or np.iscomplexobj(columns):
            raise ValueError(
                f"columns of shape {columns.shape} and type {columns.dtype} have no product of shape {product.shape}: "
                "give real ones, shape (n, k)"
            )
        if not columns.size:
            return product
        self._kernel.multiply_into(product, np.asfortranarray(columns, dtype=np.float64))
        return product


class PlainProduct:
    """Product with a matrix of the nodes by SciPy."""

    def __init__(self, matrix: sp.csr_array) -> None:
        self._matrix = matrix

    def multiply_into(self, product: Matrix, columns: Matrix) -> None:
        """As `fe.sparse.product.SparseProduct.multiply_into`."""
        wide = np.ascontiguousarray(columns).reshape(self._matrix.shape[0], -1)
        product[...] = (self._matrix @ wide).reshape(columns.shape)


def _choose_kernel(matrix: sp.csr_array, direction: int) -> "PlainProduct | SparseProduct":
    if direction * matrix.shape[0] < LONG:
        return PlainProduct(matrix)
    # Imported only for long columns, because importing the compiler takes time.
    from fe.sparse.product import SparseProduct

    return SparseProduct(matrix, direction)


def node_matrix(matrix: sp.csr_array) -> sp.csr_array | None:
    """Matrix A of a matrix A kron I_3, shape (n / 3, n / 3); None for any other matrix."""
    n = matrix.shape[0]
    length = np.diff(matrix.indptr)
    if n % NODE or (length.reshape(-1, NODE) != length[::NODE, None]).any():
        return None
    direction = np.repeat(np.arange(n) % NODE, length)
    first = direction == 0
    column, values = matrix.indices[first], matrix.data[first]
    if (column % NODE).any():
        return None
    for d in range(1, NODE):
        other = direction == d
        if (matrix.indices[other] != column + d).any() or (matrix.data[other] != values).any():
            return None
    start = np.concatenate([[0], np.cumsum(length[::NODE])])
    size = n // NODE
    return sp.csr_array((values, column // NODE, start), shape=(size, size))
