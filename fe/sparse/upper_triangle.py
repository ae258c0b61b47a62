"""Upper triangle of a symmetric matrix in the form that sparse Cholesky factorisations need."""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.sparse.factor import NODE, Symmetric
from fe.sparse.symmetric_part import PartView
from fe.sparse.upper_blocks import UpperBlocks

#: Largest ratio of entries stored in blocks of a node, zeros included, to entries of the matrix.
FILL = 1.05
#: Number of rows up to which blocks save no time.
MIN_BLOCKED = 3000


class Upper(NamedTuple):
    """Upper triangle of a symmetric matrix in square blocks: starts of rows, columns, values, and length of a block."""

    row_start: NDArray[np.int32]
    column: NDArray[np.int32]
    values: NDArray[np.float64]
    block: int


class LowerColumns(NamedTuple):
    """Columns of a lower triangle: start of each, rows of the entries, and their values, empty for a pattern."""

    start: NDArray[np.int32]
    row: NDArray[np.int32]
    values: NDArray[np.float64]


def blocks_or_csr(matrix: Symmetric) -> sp.csr_array | UpperBlocks:
    """Convert a matrix to one of the two forms whose entries can be read."""
    if isinstance(matrix, PartView):
        matrix = matrix.copy()
    if isinstance(matrix, UpperBlocks):
        return matrix
    whole = matrix.tocsr()
    if not whole.has_canonical_format:  # repeated entries, to be added
        whole = whole.copy()
        whole.sum_duplicates()
    return whole


def take_upper_triangle(matrix: sp.csr_array | UpperBlocks) -> Upper:
    """Upper triangle with its complete diagonal, in blocks of a node if rows and columns come in threes."""
    n = matrix.shape[0]
    if isinstance(matrix, UpperBlocks):
        if n > MIN_BLOCKED:
            return Upper(matrix.row_start, matrix.column, matrix.values, NODE)
        matrix = matrix.tocsr()
    length = np.diff(matrix.indptr)
    if n > MIN_BLOCKED and n % NODE == 0 and (length.reshape(-1, NODE) == length[::NODE, None]).mean() > 1 / FILL:
        blocks = matrix.tobsr((NODE, NODE))
        if blocks.nnz <= FILL * matrix.nnz:
            upper = _take_above(blocks.indptr, blocks.indices, blocks.data, NODE)
            if _has_diagonal(upper):
                return upper
    upper = _take_above(matrix.indptr, matrix.indices, matrix.data, 1)
    if not _has_diagonal(upper):
        # PARDISO needs every diagonal entry to be stored, including zeros.
        row = np.repeat(np.arange(n), np.diff(upper.row_start))
        missing = np.setdiff1d(np.arange(n), row[upper.column == row])
        values = np.concatenate([upper.values, np.zeros(len(missing))])
        places = (np.concatenate([row, missing]), np.concatenate([upper.column, missing]))
        full = sp.csr_array(sp.coo_array((values, places), shape=matrix.shape))
        upper = _take_above(full.indptr, full.indices, full.data, 1)
    return upper


def _take_above(row_start: NDArray[Any], column: NDArray[Any], values: NDArray[np.float64], block: int) -> Upper:
    n = len(row_start) - 1
    row = np.repeat(np.arange(n, dtype=column.dtype), np.diff(row_start))
    kept = column >= row
    row, column, values = row[kept], column[kept], values[kept]
    if (np.diff(row.astype(np.int64) * n + column) <= 0).any():
        order = np.lexsort((column, row))
        column, values = column[order], values[order]
    start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))])
    return Upper(start.astype(np.int32), column.astype(np.int32), np.ascontiguousarray(values, dtype=float), block)


def _has_diagonal(upper: Upper) -> bool:
    """Whether each row begins on the diagonal."""
    n = len(upper.row_start) - 1
    filled = np.diff(upper.row_start) > 0
    return bool(filled.all() and (upper.column[upper.row_start[:-1]] == np.arange(n)).all())
