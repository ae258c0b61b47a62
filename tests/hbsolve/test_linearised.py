"""One linearised step: against the whole matrices, and GMRES against elimination."""

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from hbsolve.aft import JointForces
from hbsolve.krylov import Border, gmres, operator
from hbsolve.linearised import active_rows, scattered, small_matrix, times_jacobian, transposed_jacobian
from hbsolve.newton import DENSE, ROWS_PER_VECTOR, apply_receptance, bordered_step, newton_step, transposed_receptance
from hbsolve.sampling import complex_from_real, real_from_complex

NH = 7
#: Directions of each joint, and leading rows of each direction's Jacobian that are not zero.
JOINTS = [1, 2, 3] * 7
ACTIVE = [NH, NH, 1, NH, NH, NH] * 3 + [1, 0, NH, 1, NH, 0] * 2 + [NH, NH, NH, 0, 0, 1] * 2
#: Both solve a well-conditioned system (condition below 100) to this relative residual.
RELATIVE, TOLERANCE = 1e-11, 1e-9

Real = NDArray[np.float64]


class Problem(NamedTuple):
    forces: JointForces
    columns: NDArray[np.complex128]
    first: NDArray[np.int64]
    size: NDArray[np.int64]
    rows: NDArray[np.int64]


def problem(radius: float = 0.5) -> Problem:
    """A random one, with the spectral radius `radius` of L A."""
    rng = np.random.default_rng(3)
    count = np.repeat(JOINTS, JOINTS)
    first = np.repeat(np.concatenate([[0], np.cumsum(JOINTS)[:-1]]), JOINTS)
    active = np.array(ACTIVE)
    d = len(active)
    jacobian = rng.normal(size=(d, NH, 3 * NH))
    for i in range(d):
        jacobian[i, active[i] :] = 0.0
        jacobian[i, :, count[i] * NH :] = 0.0
    columns = rng.normal(size=((NH + 1) // 2, d, d)) + 1j * rng.normal(size=((NH + 1) // 2, d, d))
    columns[0] = columns[0].real
    rows = active_rows(active)
    Z = small_matrix(rows, jacobian, first, count, columns, NH)
    columns *= radius / np.abs(np.linalg.eigvals(Z - np.eye(len(Z)))).max()
    none, nothing = np.zeros((0, 3, NH)), np.zeros((0, 0))
    forces = JointForces(
        np.zeros((d, NH)), jacobian, active, none, none, np.zeros((d, NH)), nothing, nothing.astype(np.int64), nothing,
        np.zeros(0, np.int64),
    )  # fmt: skip
    return Problem(forces, columns, first, count, rows)


def whole(case: Problem) -> tuple[Real, Real]:
    """L and A on all coefficients, shape (d nh, d nh) both."""
    jacobian, d = case.forces.jacobian, len(case.first)
    L = np.zeros((d, NH, d, NH))
    for i in range(d):
        for e in range(case.size[i]):
            L[i, :, case.first[i] + e] = jacobian[i, :, e * NH : (e + 1) * NH]
    units = np.eye(d * NH).reshape(-1, d, NH)
    A = np.array([apply_receptance(case.columns, unit).ravel() for unit in units]).T
    return L.reshape(d * NH, d * NH), A


def at_a_fold(case: Problem) -> Problem:
    """With I + L A singular, by a change of A_0 of rank one (matrix determinant lemma)."""
    d = len(case.first)
    p, q = np.random.default_rng(5).normal(size=(2, d, 1))
    forced = times_jacobian(case.rows, case.forces.jacobian, case.first, case.size, p * np.eye(NH)[0])
    Z = small_matrix(case.rows, case.forces.jacobian, case.first, case.size, case.columns, NH)
    answer = scattered(case.rows, np.linalg.solve(Z, forced), d, NH)
    columns = case.columns.copy()
    columns[0] -= q @ p.T / (q[:, 0] @ answer[:, 0])
    return case._replace(columns=columns)


def test_rows_are_enough_for_gmres_and_of_every_kind() -> None:
    case = problem()
    assert len(case.rows) > DENSE
    for n_direction in (1, 2, 3):
        assert {1, NH} <= set(case.forces.active[case.size == n_direction])


def test_small_matrix_is_that_of_the_whole_system() -> None:
    case = problem()
    L, A = whole(case)
    Z = small_matrix(case.rows, case.forces.jacobian, case.first, case.size, case.columns, NH)
    at = case.rows[:, 0] * NH + case.rows[:, 1]
    # Sums of the same few products in another order.
    np.testing.assert_allclose(Z, (np.eye(len(L)) + L @ A)[np.ix_(at, at)], rtol=0, atol=1e-14)


def test_receptance_moves_by_its_columns() -> None:
    case = problem()
    g = np.random.default_rng(6).normal(size=(len(case.first), NH))
    g[::2, 1:] = 0.0  # some forces are constant
    moved = np.einsum("kji,kj->ki", case.columns, complex_from_real(g))
    np.testing.assert_allclose(
        apply_receptance(case.columns, g), real_from_complex(moved), rtol=0, atol=1e-13 * np.abs(moved).max()
    )


def test_transposed_jacobian() -> None:
    case = problem()
    L, _ = whole(case)
    y = np.random.default_rng(7).normal(size=len(case.rows))
    result = transposed_jacobian(case.rows, case.forces.jacobian, case.first, case.size, y)
    at = case.rows[:, 0] * NH + case.rows[:, 1]
    np.testing.assert_allclose(result.ravel(), L[at].T @ y, rtol=0, atol=1e-13)  # round-off of sums of 21 products


def test_transposed_receptance() -> None:
    case = problem()
    _, A = whole(case)
    x = np.random.default_rng(1).normal(size=(len(case.first), NH))
    np.testing.assert_allclose(transposed_receptance(case.columns, x).ravel(), A.T @ x.ravel(), rtol=0, atol=1e-13)


@pytest.mark.parametrize("relative", [RELATIVE, 0.0], ids=["gmres", "elimination"])
def test_step_solves_the_whole_system(relative: float) -> None:
    case = problem()
    L, A = whole(case)
    right = np.random.default_rng(2).normal(size=(len(case.first), NH))
    result = newton_step(case.forces, case.columns, case.first, case.size, right, relative)
    exact = np.linalg.solve(np.eye(len(L)) + A @ L, right.ravel())
    np.testing.assert_allclose(result.ravel(), exact, rtol=0, atol=TOLERANCE * np.abs(exact).max())


@pytest.mark.parametrize("relative", [RELATIVE, 0.0], ids=["gmres", "elimination"])
@pytest.mark.parametrize("fold", [False, True], ids=["regular", "fold"])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_bordered_step_solves_the_whole_system_in_any_unit_of_lambda(relative: float, fold: bool, scale: float) -> None:
    case = at_a_fold(problem()) if fold else problem()
    L, A = whole(case)
    rng = np.random.default_rng(4)
    residual, by_lambda, border = rng.normal(size=(3, len(case.first), NH))
    by_lambda *= scale
    corner, remainder = 0.7 * scale, 0.3
    dx, dlambda = bordered_step(
        case.forces, case.columns, case.first, case.size, residual, by_lambda, border, corner, remainder, relative
    )
    Z = np.block([[np.eye(len(L)) + A @ L, by_lambda.reshape(-1, 1)], [border.reshape(1, -1), np.array([[corner]])]])
    if fold:
        assert np.linalg.cond(Z[:-1, :-1]) > 1e12
    Z[:, -1] /= scale
    exact = np.linalg.solve(Z, -np.append(residual.ravel(), remainder))
    result = np.append(dx.ravel(), dlambda * scale)
    np.testing.assert_allclose(result, exact, rtol=0, atol=TOLERANCE * np.abs(exact).max())


@pytest.mark.parametrize("relative", [RELATIVE, 0.0], ids=["gmres", "elimination"])
def test_a_jacobian_that_has_overflown_gives_no_step_and_no_error(relative: float) -> None:
    case = problem()
    forces = case.forces._replace(jacobian=np.full_like(case.forces.jacobian, np.inf))
    right = np.random.default_rng(2).normal(size=(len(case.first), NH))
    assert np.isnan(newton_step(forces, case.columns, case.first, case.size, right, relative)).any()
    border = (right, right, 0.7, 0.3)
    dx, dlambda = bordered_step(forces, case.columns, case.first, case.size, right, *border, relative)
    assert np.isnan(dx).any()
    assert np.isnan(dlambda)


@pytest.mark.parametrize(("radius", "fast"), [(0.5, True), (5.0, False)])
def test_gmres_is_used_where_it_is_fast_and_elimination_elsewhere(radius: float, fast: bool) -> None:
    case = problem(radius)
    matrix = operator(case.rows, case.forces.jacobian, case.first, case.size, case.columns)
    right = np.random.default_rng(2).normal(size=(len(case.first), NH))
    moved = times_jacobian(case.rows, case.forces.jacobian, case.first, case.size, right)
    none = np.empty(0)
    y, solved = gmres(matrix, Border(none, none, 0.0), moved, 1e-8, len(moved) // ROWS_PER_VECTOR)
    assert solved == fast
    steps = [newton_step(case.forces, case.columns, case.first, case.size, right, item) for item in (1e-8, 0.0)]
    assert np.array_equal(*steps) == (not fast)
    if solved:
        Z = small_matrix(case.rows, case.forces.jacobian, case.first, case.size, case.columns, NH)
        # What was asked for, and that GMRES's own count of it is true.
        assert np.linalg.norm(Z @ y - moved) < 1.01e-8 * np.linalg.norm(moved)
