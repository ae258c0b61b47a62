"""The columns of an upper triangle that is stored in rows of blocks, entry by entry and in one pass."""

from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.compiled import compiled
from fe.factor import TooLarge
from fe.upper_triangle import Upper


def block_columns(
    upper: Upper,
) -> tuple[Int[NDArray[np.int32], " n+1"], Int[NDArray[np.int32], " e"], Float[NDArray[np.float64], " e"]]:
    """Where each column begins, the rows of its entries, ascending, and their values; with its whole diagonal blocks.

    Parameters
    ----------
    upper
        In blocks of any length.

    Raises
    ------
    TooLarge
        There are more entries than 32 bits count.
    """
    b = upper.block
    n_block = np.bincount(upper.column, minlength=len(upper.row_start) - 1)
    start = np.concatenate([[0], np.cumsum(np.repeat(b * n_block, b))])
    if start[-1] > np.iinfo(np.int32).max:
        raise TooLarge(f"{start[-1]} entries are more than 32 bits count")
    start = start.astype(np.int32)
    row, values = np.empty(start[-1], dtype=np.int32), np.empty(start[-1])
    _fill(start[:-1].copy(), row, values, upper.row_start, upper.column, upper.values.reshape(-1), b)
    return start, row, values


@compiled
def _fill(place: Any, row: Any, values: Any, row_start: Any, column: Any, blocks: Any, b: int) -> None:
    for i in range(len(row_start) - 1):
        for e in range(row_start[i], row_start[i + 1]):
            for c in range(b):
                k = b * column[e] + c
                first = place[k]
                for r in range(b):
                    row[first + r] = b * i + r
                    values[first + r] = blocks[b * b * e + b * r + c]
                place[k] = first + b
