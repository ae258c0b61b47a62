"""Columns of a lower triangle, entry by entry, from an upper triangle that is stored in rows of blocks."""

from typing import Any

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from fe.compiled import compiled
from fe.sparse.factor import TooLarge
from fe.sparse.upper_triangle import LowerColumns, Upper


def lower_columns(upper: Upper, *, is_pattern: bool = False) -> LowerColumns:
    """Lower triangle in the order of the matrix; rows ascend, and blocks on the diagonal are complete.

    Parameters
    ----------
    upper
        Upper triangle in blocks of any length.
    is_pattern
        Whether values are left out.

    Raises
    ------
    TooLarge
        The number of entries exceeds 32 bits.
    """
    b = upper.block
    start = _compute_starts(np.repeat(b * np.diff(upper.row_start), b))
    row, values = np.empty(start[-1], dtype=np.int32), np.empty(0 if is_pattern else start[-1])
    _expand(row, values, upper.row_start, upper.column, upper.values.reshape(-1), b)
    return LowerColumns(start, row, values)


def ordered_columns(upper: Upper, order: Int[NDArray[np.int32], " n"]) -> LowerColumns:
    """Lower triangle of the reordered matrix; the rows of a column do not ascend.

    Parameters
    ----------
    upper
        Upper triangle in blocks of any length.
    order
        Order of rows: row k of the result is row order[k] of the matrix, shape (n,) [-].
    """
    place = np.empty_like(order)
    place[order] = np.arange(len(order), dtype=order.dtype)
    count = np.zeros(len(order), dtype=np.int64)
    _count(count, place, order, upper.row_start, upper.column, upper.block)
    start = _compute_starts(count)
    row, values = np.empty(start[-1], dtype=np.int32), np.empty(start[-1])
    blocks = upper.values.reshape(-1)
    _fill(start[:-1].copy(), row, values, place, order, upper.row_start, upper.column, blocks, upper.block)
    return LowerColumns(start, row, values)


def _compute_starts(count: NDArray[np.integer[Any]]) -> NDArray[np.int32]:
    start = np.concatenate([[0], np.cumsum(count)])
    if start[-1] > np.iinfo(np.int32).max:
        raise TooLarge(f"{start[-1]} entries exceed the range of 32-bit indices")
    return np.asarray(start, dtype=np.int32)


@compiled
def _expand(row: Any, values: Any, row_start: Any, column: Any, blocks: Any, b: int) -> None:
    """Rows of the upper triangle are columns of the lower one."""
    out = 0
    for i in range(len(row_start) - 1):
        for r in range(b):
            for e in range(row_start[i], row_start[i + 1]):
                for c in range(b):
                    row[out] = b * column[e] + c
                    if len(values):
                        values[out] = blocks[b * b * e + b * r + c]
                    out += 1


@compiled
def _count(count: Any, place: Any, order: Any, row_start: Any, column: Any, b: int) -> None:
    for k in range(len(order)):
        i, r = order[k] // b, order[k] % b
        for e in range(row_start[i], row_start[i + 1]):
            for c in range(r if column[e] == i else 0, b):
                count[min(k, place[b * column[e] + c])] += 1


@compiled
def _fill(
    free: Any, row: Any, values: Any, place: Any, order: Any, row_start: Any, column: Any, blocks: Any, b: int
) -> None:
    # Row after row in the new order, so that most writes are close together in memory.
    for k in range(len(order)):
        i, r = order[k] // b, order[k] % b
        for e in range(row_start[i], row_start[i + 1]):
            for c in range(r if column[e] == i else 0, b):
                other = place[b * column[e] + c]
                first = min(k, other)
                row[free[first]] = max(k, other)
                values[free[first]] = blocks[b * b * e + b * r + c]
                free[first] += 1
