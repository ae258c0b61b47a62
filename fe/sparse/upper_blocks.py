"""Symmetric matrix of which the upper triangle is stored, in blocks of a node: half the memory of both triangles."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.sparse.factor import NODE, check_rows

#: Number of rows of nodes that are multiplied at once; limits the memory for copies of transposed blocks.
PIECE = 4096


@dataclass(frozen=True, kw_only=True, eq=False)
class UpperBlocks:
    """Blocks on and above the diagonal, row after row, each row starting with its diagonal block.

    Parameters
    ----------
    row_start
        Index of the first block of each row, and the number of blocks, shape (n_node + 1,) [-].
    column
        Column of each block, ascending in a row, shape (n_block,) [-].
    values
        Entries of the blocks, shape (n_block, 3, 3); blocks on the diagonal are symmetric.

    Raises
    ------
    ValueError
        A row that does not begin on the diagonal, or whose columns do not ascend.
    """

    row_start: Int[NDArray[np.int32], " rows"]
    column: Int[NDArray[np.int32], " block"]
    values: Float[NDArray[np.float64], "block 3 3"]

    def __post_init__(self) -> None:
        # Arrays of the right type are not copied, because they may use most of the memory.
        for name, kind in (("row_start", np.int32), ("column", np.int32), ("values", np.float64)):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=kind))
        ascends = np.diff(self.column) > 0
        ascends[self.row_start[1:-1] - 1] = True
        begins = (np.diff(self.row_start) > 0).all() and np.array_equal(
            self.column[self.row_start[:-1]], np.arange(self.n_node)
        )
        if not begins or not ascends.all():
            raise ValueError("every row of the upper triangle begins on the diagonal, and its columns ascend")

    @property
    def n_node(self) -> int:
        """Number of rows of blocks [-]."""
        return len(self.row_start) - 1

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns of the matrix."""
        return NODE * self.n_node, NODE * self.n_node

    @property
    def nnz(self) -> int:
        """Number of entries of both triangles [-]."""
        return NODE**2 * (2 * len(self.column) - self.n_node)

    def diagonal(self) -> Float[NDArray[np.float64], " n"]:
        """Diagonal, shape (n,)."""
        return np.diagonal(self.values[self.row_start[:-1]], axis1=1, axis2=2).flatten()

    def __matmul__(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Product with a vector (n,) or columns (n, k).

        Raises
        ------
        ValueError
            A number of rows that does not match the matrix.
        """
        check_rows(self.shape, columns)
        product = np.zeros(columns.shape, dtype=np.result_type(columns, np.float64))
        for first in range(0, self.n_node, PIECE):
            above = self._piece(first)
            rows = slice(NODE * first, NODE * first + above.shape[0])
            reached = slice(NODE * first, NODE * first + above.shape[1])
            product[rows] += above @ columns[reached]
            product[reached] += above.T @ columns[rows]
        # Blocks on the diagonal have been counted twice.
        blocks = self.values[self.row_start[:-1]]
        own = blocks @ columns.reshape(self.n_node, NODE, -1)
        return product - own.reshape(columns.shape)

    def _piece(self, first: int) -> sp.bsr_array:
        """Some rows of the upper triangle, from their diagonal to their last column."""
        start = self.row_start[first : first + PIECE + 1]
        kept = slice(start[0], start[-1])
        column = self.column[kept] - np.int32(first)
        size = (NODE * (len(start) - 1), NODE * (int(column.max()) + 1))
        return sp.bsr_array((self.values[kept], column, start - start[0]), shape=size)

    def graph(self) -> sp.csr_array:
        """Symmetric matrix with the number, from 1, of the block that couples two nodes, shape (n_node, n_node)."""
        size = (self.n_node, self.n_node)
        upper = sp.csr_array((np.arange(1, len(self.column) + 1), self.column, self.row_start), shape=size)
        return sp.csr_array(upper + sp.triu(upper, 1).T)

    def tocsr(self) -> sp.csr_array:
        """Both triangles, shape (n, n)."""
        graph = self.graph()
        row = np.repeat(np.arange(self.n_node), np.diff(graph.indptr))
        values = self.values[graph.data - 1]
        below = graph.indices < row
        values[below] = values[below].swapaxes(1, 2)
        return sp.csr_array(sp.bsr_array((values, graph.indices, graph.indptr), shape=self.shape))

    def toarray(self) -> Float[NDArray[np.float64], "n n"]:
        """All entries, shape (n, n)."""
        return np.asarray(self.tocsr().toarray())

    def rows(self, rows: Int[NDArray[np.int64], " k"]) -> sp.csr_array:
        """Some complete rows of the matrix, shape (k, n)."""
        nodes, which = np.unique(rows // NODE, return_inverse=True)
        place = np.full(self.n_node, -1)
        place[nodes] = np.arange(len(nodes))
        row = np.repeat(np.arange(self.n_node), np.diff(self.row_start))
        own, mirrored = place[row] >= 0, (place[self.column] >= 0) & (self.column != row)
        block_row = np.concatenate([place[row[own]], place[self.column[mirrored]]])
        block_column = np.concatenate([self.column[own], row[mirrored]])
        values = np.concatenate([self.values[own], self.values[mirrored].swapaxes(1, 2)])
        order = np.lexsort((block_column, block_row))
        start = np.concatenate([[0], np.cumsum(np.bincount(block_row, minlength=len(nodes)))])
        size = (NODE * len(nodes), self.shape[1])
        result = sp.csr_array(sp.bsr_array((values[order], block_column[order], start), shape=size))
        return sp.csr_array(result[NODE * which + rows % NODE])

    def part(self, nodes: Int[NDArray[np.int64], " m"]) -> "UpperBlocks":
        """Copy of the rows and columns of some nodes, which must ascend."""
        place = np.full(self.n_node, -1, dtype=np.int32)
        place[nodes] = np.arange(len(nodes), dtype=np.int32)
        row = np.repeat(place, np.diff(self.row_start))
        kept = (row >= 0) & (place[self.column] >= 0)
        start = np.concatenate([[0], np.cumsum(np.bincount(row[kept], minlength=len(nodes)))])
        return UpperBlocks(row_start=start.astype(np.int32), column=place[self.column[kept]], values=self.values[kept])

    def plus_diagonal(self, added: Float[NDArray[np.float64], " n"]) -> "UpperBlocks":
        """Copy with values added to the diagonal, shape (n,)."""
        values = self.values.copy()
        for direction in range(NODE):
            values[self.row_start[:-1], direction, direction] += added[direction::NODE]
        return replace(self, values=values)
