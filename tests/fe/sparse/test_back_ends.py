"""Every factorisation gives the same answers, whatever a matrix looks like, keeps what it knows, and counts signs."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.material import STEEL
from fe.mesh import Mesh
from fe.sparse.factor import UnknownInertia
from fe.sparse.solver import Backend, Definiteness, SingularMatrix, factorise, is_available
from fe.sparse.upper_triangle import MIN_BLOCKED, take_upper_triangle
from fe.system import LinearSystem

BoxMesher = Callable[..., Mesh]


@pytest.fixture(scope="module")
def bar(box: BoxMesher) -> LinearSystem:
    """Large enough for nodes to be taken as blocks."""
    mesh = box(HEX20, counts=(14, 4, 4), size=(0.14, 0.04, 0.05), distortion=0.2)
    system = supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("x0"))])
    assert system.n_dof > MIN_BLOCKED
    return system


def reference(matrix: sp.csr_array, b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(sp.linalg.spsolve(matrix.tocsc(), b))


def without(matrix: sp.csr_array, rows: list[int]) -> sp.csr_array:
    kept = np.setdiff1d(np.arange(matrix.shape[0]), rows)
    return sp.csr_array(matrix[kept][:, kept])


@pytest.mark.parametrize("missing", [[], [0], [1000, 1001, 2500], [0, 1, 2]], ids=["none", "one", "some", "a node"])
def test_all_give_the_same_displacements_to_nine_digits(
    bar: LinearSystem, backend: Backend, missing: list[int]
) -> None:
    # With rows missing, degrees of freedom no longer come by threes: other storage, the same answer.
    matrix = without(bar.stiffness, missing)
    b = np.random.default_rng(0).standard_normal((matrix.shape[0], 13))
    result, exact = factorise(matrix, backend=backend).solve(b), reference(matrix, b)
    # Round-off times a condition of about 1e5.
    np.testing.assert_allclose(result, exact, atol=1e-9 * np.abs(exact).max(), rtol=0)


@pytest.mark.parametrize("missing", [[], [1000]], ids=["by nodes", "one row missing"])
def test_all_give_the_same_forced_response_above_resonances(
    bar: LinearSystem, backend: Backend, missing: list[int]
) -> None:
    matrix = without(sp.csr_array(bar.stiffness - 3e9 * bar.mass), missing)
    b = np.random.default_rng(0).standard_normal((matrix.shape[0], 3))
    result, exact = factorise(matrix, Definiteness.INDEFINITE, backend).solve(b), reference(matrix, b)
    # Pivots near zero take three more digits.
    np.testing.assert_allclose(result, exact, atol=1e-8 * np.abs(exact).max(), rtol=0)


@pytest.mark.skipif(not is_available(Backend.PARDISO), reason="PARDISO's wheel exists for x86-64 only")
def test_nodes_are_taken_as_blocks_where_they_can_be(bar: LinearSystem) -> None:
    whole, cut = take_upper_triangle(bar.stiffness), take_upper_triangle(without(bar.stiffness, [1000]))
    assert (whole.block, cut.block) == (3, 1)
    n = bar.n_dof // 3
    blocks = sp.bsr_array((whole.values, whole.column, whole.row_start), shape=(3 * n, 3 * n)).tocsr()
    assert abs(sp.triu(blocks) - sp.triu(bar.stiffness)).max() == 0


def test_new_values_in_the_same_places_take_the_place_of_the_old(bar: LinearSystem, backend: Backend) -> None:
    factor = factorise(bar.stiffness, backend=backend)
    stiffer = bar.stiffness.copy()
    stiffer.setdiag(2 * stiffer.diagonal())
    factor.renew(stiffer)
    b = np.random.default_rng(1).standard_normal(bar.n_dof)
    exact = reference(stiffer, b)
    np.testing.assert_allclose(factor.solve(b), exact, atol=1e-9 * np.abs(exact).max(), rtol=0)


def test_another_pattern_cannot_take_the_place(backend: Backend) -> None:
    factor = factorise(sp.csr_array(np.diag([1.0, 2.0, 3.0])), backend=backend)
    with pytest.raises(ValueError, match=r"shape \(2, 2\) with 2 entries cannot take the place of one of"):
        factor.renew(sp.csr_array(np.diag([1.0, 2.0])))


def test_singular_new_values_are_refused(backend: Backend) -> None:
    factor = factorise(sp.csr_array(np.diag([1.0, 2.0])), backend=backend)
    zero = sp.csr_array(np.diag([1.0, 2.0]))
    zero.data[1] = 0.0
    with pytest.raises(SingularMatrix, match="the matrix of 2 rows is singular"):
        factor.renew(zero)


def test_a_body_that_floats_is_singular_or_passes_and_is_no_failure(box: BoxMesher) -> None:
    """Round-off decides about its last pivots: PARDISO tells of them by codes of its own where nodes are blocks."""
    if not is_available(Backend.PARDISO):
        pytest.skip("there is no MKL")
    _, stiffness = assemble(box(HEX20, counts=(14, 4, 4), size=(0.14, 0.04, 0.05), distortion=0.2), STEEL)
    random, told = np.random.default_rng(0), 0
    for _ in range(8):
        beside = sp.diags_array(1 + 1e-14 * random.standard_normal(stiffness.shape[0]))
        try:
            factorise(sp.csr_array(beside @ stiffness @ beside), Definiteness.POSITIVE, backend=Backend.PARDISO)
        except SingularMatrix:
            told += 1
    assert told


def test_a_failed_factorisation_prints_nothing(backend: Backend, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SingularMatrix):
        factorise(sp.csr_array(np.diag([1.0, 0.0])), backend=backend)
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize("n", [40, 1200], ids=["plain", "by nodes"])
def test_negative_pivots_are_as_many_as_negative_eigenvalues(n: int, backend: Backend) -> None:
    # Diagonally dominant blocks: the signs of the diagonal are those of the eigenvalues, by Gershgorin's theorem.
    rng = np.random.default_rng(n)
    block = sp.kron(sp.diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(n, n)), np.ones((3, 3)))
    signs = np.where(rng.random(3 * n) < 0.2, -1.0, 1.0)
    matrix = sp.csr_array(block + sp.diags_array(30 * signs))
    factor = factorise(matrix, Definiteness.INDEFINITE, backend)
    assert factor.n_negative == np.count_nonzero(signs < 0)
    assert factorise(sp.csr_array(block + 30 * sp.eye_array(3 * n)), backend=backend).n_negative == 0


def test_pivots_from_beside_the_diagonal_count_nothing() -> None:
    swap = sp.csr_array(np.array([[0.0, 1.0], [1.0, 0.0]]))
    with pytest.raises(UnknownInertia, match="off-diagonal"):
        _ = factorise(swap, Definiteness.INDEFINITE, Backend.SUPERLU).n_negative


@pytest.mark.parametrize(
    "out",
    [
        np.zeros((60, 5), dtype=np.float32, order="F"),
        np.zeros((60, 5)),
        np.zeros((120, 5), order="F")[::2],
        np.zeros((5, 60), order="F"),
        np.zeros((60, 6), order="F"),
    ],
    ids=["single precision", "rows first", "every other row", "turned", "too wide"],
)
def test_an_array_that_cannot_hold_the_solution_is_left_alone(backend: Backend, out: NDArray[np.float64]) -> None:
    matrix = sp.csr_array(sp.diags_array(np.arange(1.0, 61.0)))
    b = np.ones((60, 5), order="F")
    result = factorise(matrix, backend=backend).solve(b, out)
    np.testing.assert_allclose(result, b / np.arange(1.0, 61.0)[:, None], rtol=1e-15)
    assert not out.any()
    assert not np.may_share_memory(result, out)


def test_an_array_that_can_hold_the_solution_does(backend: Backend) -> None:
    matrix = sp.csr_array(sp.diags_array(np.arange(1.0, 61.0)))
    b, out = np.ones((60, 5), order="F"), np.zeros((60, 5), order="F")
    assert factorise(matrix, backend=backend).solve(b, out) is out
    # The right-hand side itself cannot: it stays as it is.
    assert np.may_share_memory(factorise(matrix, backend=backend).solve(b, b), b) is False
    np.testing.assert_array_equal(b, 1)


@pytest.mark.parametrize("n", [59, 61, 120])
def test_a_right_hand_side_of_another_length_is_refused(backend: Backend, n: int) -> None:
    with pytest.raises(ValueError, match="cannot be multiplied by columns of shape"):
        factorise(sp.csr_array(np.eye(60)), backend=backend).solve(np.ones(n))


def test_other_places_of_as_many_entries_are_refused(backend: Backend) -> None:
    if backend is Backend.SUPERLU:
        pytest.skip("SuperLU begins anew each time")
    one, other = np.diag([4.0] * 4), np.diag([4.0] * 4)
    one[0, 1] = one[1, 0] = other[0, 3] = other[3, 0] = 1.0
    factor = factorise(sp.csr_array(one), backend=backend)
    with pytest.raises(ValueError, match="entries in other places"):
        factor.renew(sp.csr_array(other))
