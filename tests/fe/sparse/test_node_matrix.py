"""The product by nodes is the product, SciPy's or our own."""

import numpy as np
import pytest
import scipy.sparse as sp

from fe.sparse.node_matrix import BlockProduct, node_matrix

#: The order of a sum of a few products of size one.
ROUND_OFF = 1e-14


def node_level(n: int = 7) -> sp.csr_array:
    return sp.csr_array(sp.random_array((n, n), density=0.4, rng=np.random.default_rng(0)) + sp.eye_array(n))


@pytest.mark.parametrize("columns", [1, 5])
@pytest.mark.parametrize("order", ["C", "F"])
def test_the_product_by_nodes_is_the_product(columns: int, order: str) -> None:
    matrix = sp.csr_array(sp.kron(node_level(), np.eye(3)))
    x = np.array(np.random.default_rng(1).standard_normal((21, columns)), order=order)
    assert node_matrix(matrix) is not None
    np.testing.assert_allclose(BlockProduct(matrix) @ x, matrix @ x, rtol=0, atol=ROUND_OFF)


def scaled() -> sp.csr_array:
    return sp.csr_array(sp.kron(node_level(), np.diag([1.0, 1.0, 2.0])))


def cut() -> sp.csr_array:
    return sp.csr_array(sp.kron(node_level(), np.eye(3)))[1:19, 1:19]


def moved() -> sp.csr_array:
    return sp.csr_array(sp.kron(node_level(), np.roll(np.eye(3), 1, axis=0)))


@pytest.mark.parametrize("make", [scaled, cut, moved, node_level], ids=lambda make: make.__name__)
def test_a_matrix_that_differs_between_directions_is_multiplied_as_it_is(make) -> None:
    matrix = make()
    assert node_matrix(matrix) is None
    x = np.random.default_rng(1).standard_normal((matrix.shape[1], 4))
    np.testing.assert_allclose(BlockProduct(matrix) @ x, matrix @ x, rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize("make", [node_level, scaled], ids=["nodes", "directions"])
def test_a_passing_product_is_the_same_and_is_written_over(make) -> None:
    matrix = sp.csr_array(sp.kron(make(), np.eye(3)))
    product = BlockProduct(matrix)
    first, second = np.random.default_rng(1).standard_normal((2, matrix.shape[1], 4))
    kept, multiply_in_workspace = product @ first, product.multiply_in_workspace(first)
    np.testing.assert_array_equal(multiply_in_workspace, kept)
    np.testing.assert_array_equal(product.multiply_in_workspace(second), product @ second)
    np.testing.assert_array_equal(multiply_in_workspace, product @ second)
