"""Solutions with supernodes against dense matrices, for every shape that a tile can have."""

from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from fe.sparse.supernodes import Supernodes, _forward, pack

Matrix = NDArray[np.float64]


def factor(widths: list[int], seed: int) -> tuple[Matrix, list[NDArray[np.int32]]]:
    """A lower triangle whose columns come in groups, and the rows that each group has entries in."""
    random = np.random.default_rng(seed)
    start = np.concatenate([[0], np.cumsum(widths)])
    n = int(start[-1])
    L, rows = np.zeros((n, n)), []
    for first, last in pairwise(start):
        below = np.flatnonzero(random.random(n - last) < random.random()) + last
        rows.append(np.concatenate([np.arange(first, last), below]).astype(np.int32))
        L[np.ix_(rows[-1], range(first, last))] = random.uniform(-1, 1, (len(rows[-1]), last - first))
    L = np.tril(L, -1) / np.sqrt(n)
    np.fill_diagonal(L, random.uniform(1, 2, n))
    return L, rows


def supernodes(L: Matrix, widths: list[int], rows: list[NDArray[np.int32]], order: NDArray[np.int32]) -> Supernodes:
    """As CHOLMOD stores them: whole columns of a group, with what stands above the diagonal, which means nothing."""
    column = np.concatenate([[0], np.cumsum(widths)]).astype(np.int32)
    row_start = np.concatenate([[0], np.cumsum([len(item) for item in rows])]).astype(np.int32)
    blocks = []
    for k, item in enumerate(rows):
        block = L[np.ix_(item, range(column[k], column[k + 1]))]
        block[np.triu_indices(widths[k], 1)] = np.nan
        blocks.append(block.ravel(order="F"))
    value_start = np.concatenate([[0], np.cumsum([len(item) for item in blocks])]).astype(np.int32)
    values = np.concatenate(blocks)
    layout, n_value = pack(values, column, row_start, value_start, np.concatenate(rows))
    return Supernodes(values[:n_value].copy(), layout, order)


@given(
    widths=st.lists(st.integers(1, 21), min_size=1, max_size=12),
    n_column=st.integers(1, 30),
    n_loaded=st.sampled_from([0, 1, 3, 1000]),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=80, deadline=None)
def test_they_solve_as_a_dense_matrix_does(widths: list[int], n_column: int, n_loaded: int, seed: int) -> None:
    L, rows = factor(widths, seed)
    random = np.random.default_rng(seed)
    order = random.permutation(len(L)).astype(np.int32)
    b = np.asfortranarray(random.standard_normal((len(L), n_column)))
    b[random.permutation(len(L))[n_loaded:]] = 0  # what is zero before a supernode is left alone
    before, result = b.copy(), np.full_like(b, np.nan)
    supernodes(L, widths, rows, order).solve_into(result, b)
    half = scipy.linalg.solve_triangular(L, b[order], lower=True)
    exact = np.empty_like(b)
    exact[order] = scipy.linalg.solve_triangular(L, half, lower=True, trans="T")
    # Round-off times the condition of both triangles, whose diagonals are 1 to 2 and whose rows are short.
    condition = np.linalg.cond(L) ** 2
    np.testing.assert_allclose(result, exact, atol=1e-15 * len(L) * condition * np.abs(exact).max(), rtol=0)
    np.testing.assert_array_equal(b, before)


def test_supernodes_before_which_all_is_zero_are_passed_by() -> None:
    widths, rows = [5, 9], [np.arange(5, dtype=np.int32), np.arange(5, 14, dtype=np.int32)]
    L = np.eye(14)
    solver = supernodes(L, widths, rows, np.arange(14, dtype=np.int32))
    solver._values[: solver._layout.tile_start[1]] = np.nan
    x = np.zeros((14, 4))
    x[13] = 1.0
    _forward(solver._values.ctypes.data, solver._layout, x, (0, 0, 0, 0))
    np.testing.assert_array_equal(x[:13], 0.0)
    np.testing.assert_array_equal(x[13], 1.0)


def test_tiles_leave_out_what_is_above_the_diagonal() -> None:
    widths = [40, 30, 50]
    _, rows = factor(widths, 3)
    values = np.concatenate([np.ones(width * len(item)) for width, item in zip(widths, rows, strict=True)])
    column = np.concatenate([[0], np.cumsum(widths)]).astype(np.int32)
    row_start = np.concatenate([[0], np.cumsum([len(item) for item in rows])]).astype(np.int32)
    sizes = [width * len(item) for width, item in zip(widths, rows, strict=True)]
    value_start = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)
    _layout, n_value = pack(values, column, row_start, value_start, np.concatenate(rows))
    triangles = sum(width * (width - 1) // 2 for width in widths)
    # Of a triangle there remain, in each tile, the few entries above its own diagonal.
    assert len(values) - triangles <= n_value < len(values) - 0.75 * triangles


def test_the_count_of_work_is_that_of_a_dense_factor() -> None:
    n = 37
    L, rows = factor([n], 0)
    entries, operations = supernodes(L, [n], rows, np.arange(n, dtype=np.int32)).work
    assert entries == n * (n + 1) / 2
    # A column of height h takes h^2 operations: a root, h - 1 quotients, and h (h - 1) for what it alters.
    assert operations == sum(h * h for h in range(1, n + 1))


@pytest.mark.parametrize("n_column", [1, 12, 16, 24, 25, 53])
def test_columns_do_not_touch_one_another(n_column: int) -> None:
    L, rows = factor([9, 4, 17, 1], 5)
    solver = supernodes(L, [9, 4, 17, 1], rows, np.arange(31, dtype=np.int32))
    b = np.asfortranarray(np.random.default_rng(2).standard_normal((31, n_column)))
    together, alone = np.empty_like(b), np.empty_like(b)
    solver.solve_into(together, b)
    for k in range(n_column):
        solver.solve_into(alone[:, k : k + 1], b[:, k : k + 1])
    # Registers of other lengths round in the same way, number by number.
    np.testing.assert_array_equal(together, alone)
