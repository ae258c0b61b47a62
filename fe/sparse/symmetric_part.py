"""Parts of a symmetric matrix, stored as the matrix itself is where they are made of whole nodes."""

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
    """Rows and columns of a matrix: a copy, shape (k, k).

    Parameters
    ----------
    matrix
        Shape (n, n).
    rows
        In any order [-].
    """
    if isinstance(matrix, NodeMatrix | UpperBlocks):
        nodes = find_whole_nodes(rows)
        if nodes is not None:
            return matrix.part(nodes)
    return sp.csr_array(matrix.tocsr()[rows][:, rows])


@dataclass(frozen=True, kw_only=True, eq=False)
class PartView:
    """A part of a matrix, without a copy of it until one is needed.

    Parameters
    ----------
    matrix
        The whole, shape (n, n).
    rows
        Those of the part, in any order, shape (k,) [-].
    """

    matrix: Symmetric
    rows: Rows

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the part."""
        return len(self.rows), len(self.rows)

    def __matmul__(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Product with a vector (k,) or columns (k, m)."""
        whole = np.zeros((self.matrix.shape[0], *columns.shape[1:]))
        whole[self.rows] = columns
        return np.asarray((self.matrix @ whole)[self.rows])

    def diagonal(self) -> NDArray[np.float64]:
        """The diagonal, shape (k,)."""
        return np.asarray(self.matrix.diagonal()[self.rows])

    def copy(self) -> Symmetric:
        """As `part`."""
        return part(self.matrix, self.rows)

    def tocsr(self) -> sp.csr_array:
        """A copy, shape (k, k)."""
        return self.copy().tocsr()

    def toarray(self) -> NDArray[np.float64]:
        """All entries, shape (k, k)."""
        return np.asarray(self.tocsr().toarray())


def take_rows(matrix: Symmetric, rows: Rows) -> sp.csr_array:
    """Some rows of a matrix, over all its columns, shape (k, n)."""
    return matrix.rows(rows) if isinstance(matrix, UpperBlocks) else sp.csr_array(matrix.tocsr()[rows])


def find_whole_nodes(rows: Rows) -> Rows | None:
    """Nodes whose degrees of freedom these are, all of each, in ascending order; None of any other rows."""
    nodes = rows[::NODE] // NODE
    ascends = (np.diff(rows) > 0).all()
    return nodes if ascends and np.array_equal(rows, (NODE * nodes[:, None] + np.arange(NODE)).ravel()) else None
