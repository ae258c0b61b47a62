"""Products of a long basis with the few columns of a block, which read the basis once at the speed of the memory.

Matrix products of BLAS are made for matrices closer to square, and take 1.5 to 2 times as long.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.compiled import compiled
from fe.sparse.simd_code import ROWS, SIZE, groups
from fe.sparse.simd_sum import add_combination, add_projection

Matrix = NDArray[np.float64]

#: Number of rows that stay in the nearest cache while all columns of the basis are read.
PIECE = 512
#: Number of columns of the basis that are read side by side.
GROUP = 24


def project(basis: Float[Matrix, "n m"], columns: Float[Matrix, "n k"]) -> Float[Matrix, "m k"]:
    """Product basis^T columns; both are in Fortran order."""
    result = np.empty((basis.shape[1], columns.shape[1]), order="F")
    for some, lanes in groups(columns.shape[1]):
        sums = np.zeros((len(result), len(lanes)))
        _project(sums, basis.T, columns[:, some].T, np.zeros((PIECE, len(lanes))), lanes)
        result[:, some] = sums[:, : some.stop - some.start]
    return result


def subtract(columns: Float[Matrix, "n k"], basis: Float[Matrix, "n m"], factors: Float[Matrix, "m k"]) -> None:
    """Subtract basis @ factors from the columns in place; columns and basis are in Fortran order."""
    for some, lanes in groups(columns.shape[1]):
        negative = np.zeros((len(factors), len(lanes)))
        negative[:, : some.stop - some.start] = -factors[:, some]
        _add(columns[:, some].T, basis.T, negative, np.zeros((PIECE, len(lanes))), lanes)


@compiled
def _project(sums: Any, basis: Any, columns: Any, rows: Any, lanes: Any) -> None:
    m, n = basis.shape
    stride = basis.strides[0]
    for first in range(0, n, len(rows)):
        some = min(len(rows), n - first)
        for k in range(len(columns)):
            for i in range(some):
                rows[i, k] = columns[k, first + i]
        place = basis.ctypes.data + SIZE * first
        c = 0
        while c < m:
            total = sums.ctypes.data + SIZE * len(lanes) * c
            height = ROWS if c + ROWS <= m else 1
            add_projection(place + stride * c, stride, rows.ctypes.data, some, total, height, lanes)
            c += height


@compiled
def _add(columns: Any, basis: Any, factors: Any, rows: Any, lanes: Any) -> None:
    m, n = basis.shape
    stride, address = basis.strides[0], basis.ctypes.data
    for first in range(0, n, len(rows)):
        some = min(len(rows), n - first)
        for k in range(len(columns)):
            for i in range(some):
                rows[i, k] = columns[k, first + i]
        for c in range(0, m, GROUP):
            group = min(GROUP, m - c)
            place = address + stride * c + SIZE * first
            factor = factors.ctypes.data + SIZE * len(lanes) * c
            i = 0
            while i < some:
                total = rows.ctypes.data + SIZE * len(lanes) * i
                height = ROWS if i + ROWS <= some else 1
                add_combination(place + SIZE * i, stride, factor, group, total, height, lanes)
                i += height
        for k in range(len(columns)):
            for i in range(some):
                columns[k, first + i] = rows[i, k]
