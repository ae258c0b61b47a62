"""Products with a sparse matrix are those of SciPy, whatever the lengths and the directions."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from fe import node_matrix
from fe.node_matrix import BlockProduct
from fe.sparse_product import PIECE, SparseProduct


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
        multiply.into(product, columns)
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
