"""Solve with a Cholesky factor whose columns are grouped into supernodes, for several right-hand sides at a time.

The columns of a supernode have entries in the same rows: a triangle, and a rectangle below. Both are cut into tiles of
a few rows, stored in the order of their use, so that each pass over the factor reads it once, as fast as the memory
allows.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.compiled import compiled
from fe.sparse.simd_code import ROWS, SHORT_SIZE, SIZE, TALLEST, Buffer, groups
from fe.sparse.simd_tile import solve_lower, solve_upper, subtract_product, subtract_transposed_product

Matrix = NDArray[np.float64]


class SupernodeLayout(NamedTuple):
    """First column, row and tile of each supernode, and its rows; the first rows are those of its columns."""

    column: Int[NDArray[np.int64], " s+1"]
    row_start: Int[NDArray[np.int64], " s+1"]
    tile_start: Int[NDArray[np.int64], " s"]
    row: Int[NDArray[np.int32], " r"]


def pack(
    values: Float[Matrix, " x"],
    column: Int[NDArray[np.int32], " s+1"],
    row_start: Int[NDArray[np.int32], " s+1"],
    value_start: Int[NDArray[np.int32], " s+1"],
    row: Int[NDArray[np.int32], " r"],
) -> tuple[SupernodeLayout, int]:
    """Cut supernodes into tiles in place.

    Parameters
    ----------
    values
        Blocks of the supernodes, column after column with all their rows.
    column, row_start, value_start
        First column, row and value of each supernode, shape (s + 1,).
    row
        Rows of the supernodes.

    Returns
    -------
    Layout of the tiles, and the number of values that they use; the rest is free.

    References
    ----------
    Chen, Davis, Hager and Rajamanickam, Algorithm 887: CHOLMOD, ACM Trans. Math. Softw. 35 (2008) 22, section 3.
    """
    columns, rows, first = (item.astype(np.int64) for item in (column, row_start, value_start))
    # Rows are prefetched ahead of their use, so the list must continue after the last row.
    padded = np.append(row, np.zeros(TALLEST, dtype=np.int32))
    layout = SupernodeLayout(columns, rows, np.empty(len(column) - 1, dtype=np.int64), padded)
    largest = int(np.max(np.diff(columns) * np.diff(rows), initial=0))
    return layout, int(_pack(values, layout, first, np.empty(largest)))


class Supernodes:
    """Cholesky factor L of P A P^T = L L^T.

    Parameters
    ----------
    values, layout
        Values and layout of the tiles from `pack`; they are not copied.
    order
        Permutation P: row k of the factor is row order[k] of A, shape (n,).
    """

    def __init__(
        self, values: Float[Matrix, " x"], layout: SupernodeLayout, order: Int[NDArray[np.int32], " n"]
    ) -> None:
        self._values, self._layout, self._order = values, layout, order
        self._buffer = Buffer()

    @property
    def work(self) -> tuple[float, float]:
        """Number of entries of the triangle, and number of operations of the factorisation [-]."""
        n_column, n_row = (np.diff(item).astype(float) for item in (self._layout.column, self._layout.row_start))
        entries = n_column * n_row - n_column * (n_column - 1) / 2
        # The squares of the heights of all columns, from n_row down to n_row - n_column + 1.
        below = n_row - n_column
        operations = _sum_squares(n_row) - _sum_squares(below)
        return float(entries.sum()), float(operations.sum())

    def solve_into(self, solution: Float[Matrix, "n k"], right_hand_side: Float[Matrix, "n k"]) -> None:
        """Solve A x = b for several right-hand sides; both are in Fortran order."""
        for some, lanes in groups(right_hand_side.shape[1]):
            # Transposed, they are in C order, even a single column: machine code is compiled for the order.
            b, x, work = (
                right_hand_side[:, some].T,
                solution[:, some].T,
                self._buffer.rows(len(self._order), len(lanes)),
            )
            _solve(self._values, self._layout, self._order, b, x, work, lanes)


def _sum_squares(n: Float[Matrix, " s"]) -> Float[Matrix, " s"]:
    """Sum of the squares of 1 to n."""
    return n * (n + 1) * (2 * n + 1) / 6


@compiled
def _height(left: int) -> int:
    """Number of rows of the next tile, if `left` rows are left."""
    height = ROWS
    while height > left:
        height //= 2
    return height


@compiled
def _pack(values: Any, layout: Any, value_start: Any, block: Any) -> int:
    """Cut each supernode into tiles without the part above the diagonal; return the number of values."""
    out = 0
    for s in range(len(layout.tile_start)):
        n_column = layout.column[s + 1] - layout.column[s]
        n_row = layout.row_start[s + 1] - layout.row_start[s]
        layout.tile_start[s] = out
        first = value_start[s]
        for k in range(n_column * n_row):
            block[k] = values[first + k]
        r = 0
        while r < n_column:
            height = _height(n_column - r)
            for c in range(r + height):
                for k in range(r, r + height):
                    entry = block[c * n_row + k]
                    values[out] = entry if c < k else (1 / entry if c == k else 0.0)
                    out += 1
            r += height
        while r < n_row:
            height = _height(n_row - r)
            for c in range(n_column):
                if height == ROWS:
                    for k in range(ROWS):
                        values[out + k] = block[c * n_row + r + k]
                else:
                    for k in range(height):
                        values[out + k] = block[c * n_row + r + k]
                out += height
            r += height
    return out


@compiled
def _solve(values: Any, layout: Any, order: Any, b: Any, solution: Any, x: Any, lanes: Any) -> None:
    n_column, n = b.shape
    for i in range(n):
        for k in range(n_column):
            x[i, k] = b[k, order[i]]
        for k in range(n_column, len(lanes)):
            x[i, k] = 0.0
    _forward(values.ctypes.data, layout, x, lanes)
    _backward(values.ctypes.data, layout, x.ctypes.data, lanes)
    for i in range(n):
        for k in range(n_column):
            solution[k, order[i]] = x[i, k]


@compiled
def _any(x: Any, first: int, last: int) -> bool:
    """Whether any of the rows is not zero."""
    for i in range(first, last):
        for k in range(x.shape[1]):
            if x[i, k] != 0.0:
                return True
    return False


@compiled
def _forward(values: int, layout: Any, columns: Any, lanes: Any) -> None:
    """Replace x by L^-1 x."""
    rows, x = layout.row.ctypes.data, columns.ctypes.data
    for s in range(len(layout.tile_start)):
        n_column = layout.column[s + 1] - layout.column[s]
        n_row = layout.row_start[s + 1] - layout.row_start[s]
        tile = values + SIZE * layout.tile_start[s]
        own = x + SIZE * len(lanes) * layout.column[s]
        # With forces on few nodes, as for constraint modes, most supernodes can be skipped.
        if not _any(columns, layout.column[s], layout.column[s + 1]):
            continue
        r = 0
        while r < n_column:
            height = _height(n_column - r)
            solve_lower(tile, own, r, height, lanes)
            tile += SIZE * height * (r + height)
            r += height
        while r < n_row:
            height = _height(n_row - r)
            subtract_product(tile, own, n_column, x, rows + SHORT_SIZE * (layout.row_start[s] + r), height, lanes)
            tile += SIZE * height * n_column
            r += height


@compiled
def _backward(values: int, layout: Any, x: int, lanes: Any) -> None:
    """Replace x by L^-T x."""
    rows = layout.row.ctypes.data
    for s in range(len(layout.tile_start) - 1, -1, -1):
        n_column = layout.column[s + 1] - layout.column[s]
        n_row = layout.row_start[s + 1] - layout.row_start[s]
        triangle, r = layout.tile_start[s], 0
        while r < n_column:
            height = _height(n_column - r)
            triangle += height * (r + height)
            r += height
        own = x + SIZE * len(lanes) * layout.column[s]
        tile = values + SIZE * triangle
        while r < n_row:
            height = _height(n_row - r)
            row = rows + SHORT_SIZE * (layout.row_start[s] + r)
            subtract_transposed_product(tile, own, n_column, x, row, height, lanes)
            tile += SIZE * height * n_column
            r += height
        tile, r = values + SIZE * triangle, n_column
        while r > 0:
            # Each tile starts at a multiple of its height, so the lowest set bit of r is the height of the last tile.
            height = min(ROWS, r & -r)
            r -= height
            tile -= SIZE * height * (r + height)
            solve_upper(tile, own, r, height, lanes)
