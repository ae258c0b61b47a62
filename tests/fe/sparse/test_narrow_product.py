"""Products with a long basis are those of NumPy, whatever the lengths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fe.sparse.krylov_basis
from fe.sparse.block_lanczos import block_lanczos
from fe.sparse.narrow_product import PIECE, project, subtract


@given(
    n=st.one_of(st.integers(1, 40), st.integers(PIECE - 9, 2 * PIECE + 9)),
    m=st.integers(1, 70),
    k=st.integers(1, 21),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=80, deadline=None)
def test_they_are_those_of_numpy(n: int, m: int, k: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    whole = np.asfortranarray(random.standard_normal((n, m + 3)))
    basis, columns = whole[:, :m], np.asfortranarray(random.standard_normal((n, k)))
    factors = project(basis, columns)
    # Round-off of sums of n and of m products of numbers of order one.
    np.testing.assert_allclose(factors, basis.T @ columns, atol=1e-15 * n * 10, rtol=0)
    rest = columns.copy(order="F")
    subtract(rest, basis, factors)
    scale = np.abs(basis) @ np.abs(factors)
    np.testing.assert_allclose(rest, columns - basis @ factors, atol=1e-15 * m * scale.max(), rtol=0)
    assert factors.flags.f_contiguous


@pytest.mark.parametrize("n_mode", [3, 30])
def test_lanczos_finds_the_same_modes_with_them(n_mode: int, monkeypatch: pytest.MonkeyPatch) -> None:
    from scipy import sparse as sp

    from fe.sparse.solver import factorise

    n = 300
    chain = sp.csr_array(sp.diags_array([2 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1]))
    monkeypatch.setattr(fe.sparse.krylov_basis, "LONG", 0)
    lambda_, shapes = block_lanczos(factorise(chain), sp.eye_array(n, format="csr"), n_mode)
    exact = 2 - 2 * np.cos(np.arange(1, n_mode + 1) * np.pi / (n + 1))
    np.testing.assert_allclose(lambda_, exact, rtol=1e-11)  # round-off times the condition, 4 / 1e-4
    np.testing.assert_allclose(shapes.T @ shapes, np.eye(n_mode), atol=1e-11)
