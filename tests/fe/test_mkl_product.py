"""MKL's product is SciPy's."""

import numpy as np
import pytest
import scipy.sparse as sp

from fe import node_matrix
from fe.mkl_product import MklProduct
from fe.node_matrix import BlockProduct

#: A sum of seven products in another order.
ROUND_OFF = 1e-14


@pytest.fixture
def matrix() -> sp.csr_array:
    generator = np.random.default_rng(2)
    return sp.csr_array(sp.random_array((30, 20), density=0.35, rng=generator, data_sampler=generator.standard_normal))


def product(matrix: sp.csr_array) -> MklProduct:
    pytest.importorskip("pypardiso", reason="MKL's wheel exists for x86-64 only")
    return MklProduct(matrix)


@pytest.mark.parametrize("k", [0, 1, 3, 40])
def test_it_multiplies_as_scipy_does(matrix: sp.csr_array, k: int) -> None:
    columns, result = np.random.default_rng(3).standard_normal((20, k)), np.full((30, k), np.nan)
    product(matrix).into(result, columns)
    np.testing.assert_allclose(result, matrix @ columns, rtol=0, atol=20 * ROUND_OFF)


def test_what_would_read_other_memory_is_refused(matrix: sp.csr_array) -> None:
    multiply = product(matrix)
    with pytest.raises(ValueError, match=r"a matrix \(30, 20\) cannot take \(30, 2\) to \(30, 2\)"):
        multiply.into(np.empty((30, 2)), np.empty((30, 2)))
    with pytest.raises(ValueError, match="in C order"):
        multiply.into(np.empty((30, 2)), np.empty((20, 2), order="F"))


def test_without_mkl_scipy_multiplies(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(_matrix: sp.csr_array) -> None:
        raise ImportError("no wheel")

    monkeypatch.setattr(node_matrix, "MklProduct", absent)
    node = sp.csr_array(np.array([[2.0, -1.0], [-1.0, 3.0]]))
    matrix = sp.csr_array(sp.kron(node, np.eye(3)))
    columns = np.random.default_rng(4).standard_normal((6, 5))
    np.testing.assert_array_equal(BlockProduct(matrix) @ columns, matrix @ columns)
