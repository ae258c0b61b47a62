"""Parts of a symmetric matrix, stored as the matrix itself is where they are made of whole nodes."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int
from numpy.typing import NDArray

from fe.factor import NODE, Symmetric
from fe.node_matrix import NodeMatrix
from fe.upper_blocks import UpperBlocks

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
        nodes = whole_nodes(rows)
        if nodes is not None:
            return matrix.part(nodes)
    return sp.csr_array(matrix.tocsr()[rows][:, rows])


def rows_of(matrix: Symmetric, rows: Rows) -> sp.csr_array:
    """Some rows of a matrix, over all its columns, shape (k, n)."""
    return matrix.rows(rows) if isinstance(matrix, UpperBlocks) else sp.csr_array(matrix.tocsr()[rows])


def whole_nodes(rows: Rows) -> Rows | None:
    """Nodes whose degrees of freedom these are, all of each, in ascending order; None of any other rows."""
    nodes = rows[::NODE] // NODE
    ascends = (np.diff(rows) > 0).all()
    return nodes if ascends and np.array_equal(rows, (NODE * nodes[:, None] + np.arange(NODE)).ravel()) else None
