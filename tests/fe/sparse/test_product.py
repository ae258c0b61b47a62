"""Products with a sparse matrix are those of SciPy, whatever the lengths and the directions."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from fe.sparse import node_matrix
from fe.sparse.node_matrix import BlockProduct
from fe.sparse.product import PIECE, SparseProduct


@given(
    n_node=st.one_of(st.integers(1, 30), st.integers(PIECE - 3, 2 * PIECE + 3)),
    direction=st.sampled_from([1, 3]),
    k=st.integers(1, 27),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=80, deadline=None)
def test_they_are_those_of_scipy(n_node: int, direction: int, k: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    # Some rows are empty.
    nodes = sp.csr_array(sp.random_array((n_node, n_node), density=0.1, rng=random))
    columns = np.asfortranarray(random.standard_normal((direction * n_node, k)))
    product = np.full_like(columns, np.nan)
    multiply = SparseProduct(nodes, direction)
    for _ in range(2):  # what the first leaves in the room does not matter
        multiply.multiply_into(product, columns)
    # Round-off of sums of n products of numbers of order one.
    expected = sp.kron(nodes, np.eye(direction)) @ columns
    np.testing.assert_allclose(product, expected, atol=1e-15 * (n_node + 1) * 10, rtol=0)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("direction", [1, 3])
def test_long_columns_go_through_it(order: str, direction: int, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(0)
    nodes = sp.csr_array(sp.random_array((20, 20), density=0.3, rng=random))
    matrix = sp.csr_array(sp.kron(nodes, np.eye(direction)))
    columns = np.array(random.standard_normal((20 * direction, 7)), order=order)
    monkeypatch.setattr(node_matrix, "LONG", 0)
    product = BlockProduct(matrix)
    assert isinstance(product._kernel, SparseProduct)
    np.testing.assert_allclose(product @ columns, matrix @ columns, atol=1e-14, rtol=0)
    np.testing.assert_allclose(product @ columns[:, 2:4], matrix @ columns[:, 2:4], atol=1e-14, rtol=0)


def test_widths_may_change_from_one_product_to_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(1)
    nodes = sp.csr_array(sp.random_array((90, 90), density=0.1, rng=random))
    matrix = sp.csr_array(sp.kron(nodes, np.eye(3)))
    monkeypatch.setattr(node_matrix, "LONG", 0)
    product = BlockProduct(matrix)
    for k in (5, 24, 1, 30, 0, 12):
        columns = random.standard_normal((270, k))
        np.testing.assert_allclose(product.multiply_in_workspace(columns), matrix @ columns, atol=1e-13, rtol=0)


@pytest.mark.parametrize("long", [0, 10_000], ids=["own", "SciPy's"])
def test_what_does_not_fit_is_refused(long: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_matrix, "LONG", long)
    product = BlockProduct(sp.csr_array(sp.kron(sp.eye_array(4), np.eye(3))))
    for n_row in (6, 11, 24):
        with pytest.raises(ValueError, match=rf"cannot be multiplied by columns of shape \({n_row}, 2\)"):
            product @ np.ones((n_row, 2))
    for place, columns in (
        (np.empty((11, 3)), np.ones((12, 3))),
        (np.empty((12, 1)), np.ones((12, 3))),
        (np.empty(12), np.ones(12)),
        (np.empty((12, 1)), np.ones((12, 1), dtype=complex)),
    ):
        with pytest.raises(ValueError, match="give real ones"):
            product.multiply_into(place, columns)
