"""Parts of a symmetric matrix; parts that consist of whole nodes are stored in the form of the matrix."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int
from numpy.typing import NDArray

from fe.sparse.factor import NODE, Symmetric
from fe.sparse.node_matrix import NodeMatrix
from fe.sparse.upper_blocks import UpperBlocks

Rows = Int[NDArray[np.int64], " k"]


def part(matrix: Symmetric, rows: Rows) -> Symmetric:
    """Copy of some rows and columns of a matrix, shape (k, k).

    Parameters
    ----------
    matrix
        Matrix, shape (n, n).
    rows
        Rows in any order, shape (k,) [-].
    """
    if isinstance(matrix, NodeMatrix | UpperBlocks):
        nodes = find_whole_nodes(rows)
        if nodes is not None:
            return matrix.part(nodes)
    return sp.csr_array(matrix.tocsr()[rows][:, rows])


@dataclass(frozen=True, kw_only=True, eq=False)
class PartView:
    """Part of a matrix that is copied only when needed.

    Parameters
    ----------
    matrix
        Whole matrix, shape (n, n).
    rows
        Rows of the part in any order, shape (k,) [-].
    """

    matrix: Symmetric
    rows: Rows

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns of the part."""
        return len(self.rows), len(self.rows)

    def __matmul__(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Product with a vector (k,) or columns (k, m)."""
        whole = np.zeros((self.matrix.shape[0], *columns.shape[1:]))
        whole[self.rows] = columns
        return np.asarray((self.matrix @ whole)[self.rows])

    def diagonal(self) -> NDArray[np.float64]:
        """Diagonal, shape (k,)."""
        return np.asarray(self.matrix.diagonal()[self.rows])

    def copy(self) -> Symmetric:
        """Copy of the part, see `part`."""
        return part(self.matrix, self.rows)

    def tocsr(self) -> sp.csr_array:
        """Copy as CSR, shape (k, k)."""
        return self.copy().tocsr()

    def toarray(self) -> NDArray[np.float64]:
        """All entries, shape (k, k)."""
        return np.asarray(self.tocsr().toarray())


def take_rows(matrix: Symmetric, rows: Rows) -> sp.csr_array:
    """Some rows of a matrix, over all its columns, shape (k, n)."""
    return matrix.rows(rows) if isinstance(matrix, UpperBlocks) else sp.csr_array(matrix.tocsr()[rows])


def find_whole_nodes(rows: Rows) -> Rows | None:
    """Nodes of the rows if these are all degrees of freedom of nodes in ascending order, else None."""
    nodes = rows[::NODE] // NODE
    ascends = (np.diff(rows) > 0).all()
    return nodes if ascends and np.array_equal(rows, (NODE * nodes[:, None] + np.arange(NODE)).ravel()) else None
