"""Groups of equal rows, compared with NumPy's `unique`."""

import numpy as np
import pytest

from correlation.row_group import group_rows


@pytest.mark.parametrize("n", [0, 1, 500])
def test_groups_are_those_of_unique(n: int) -> None:
    rows = np.random.default_rng(5).integers(-2, 3, (n, 3)) / 4
    unique, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    result = group_rows(list(rows.T))
    assert np.array_equal(rows[result.first], unique)
    assert np.array_equal(result.first, first)
    assert np.array_equal(result.number, number.ravel())


def test_columns_may_be_of_several_types() -> None:
    result = group_rows([np.array(["b", "a", "b", "b"]), np.array([True, True, False, True]), np.array([1, 1, 1, 1])])
    assert result.first.tolist() == [1, 2, 0]
    assert result.number.tolist() == [2, 0, 1, 2]
