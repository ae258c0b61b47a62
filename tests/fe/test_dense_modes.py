"""The low eigenvalues of a stiff matrix keep their digits."""

from fractions import Fraction

import numpy as np
import pytest
import scipy.linalg

from fe.dense_modes import compute_dense_modes


def exact_lowest(mass: np.ndarray, stiffness: np.ndarray) -> float:
    """Inverse iteration in rational numbers; the next eigenvalue is 1e6 times higher, so four steps do."""
    M, K = ([[Fraction(float(x)) for x in row] for row in matrix] for matrix in (mass, stiffness))
    x = [Fraction(1), Fraction(0), Fraction(0)]
    for _ in range(4):
        x = solve(K, times(M, x))
        x = [value / x[0] for value in x]
    return float(dot(x, times(K, x)) / dot(x, times(M, x)))


def dot(x: list[Fraction], y: list[Fraction]) -> Fraction:
    return sum((a * b for a, b in zip(x, y, strict=True)), Fraction(0))


def times(matrix: list[list[Fraction]], x: list[Fraction]) -> list[Fraction]:
    return [dot(row, x) for row in matrix]


def solve(matrix: list[list[Fraction]], b: list[Fraction]) -> list[Fraction]:
    rows = [[*row, value] for row, value in zip(matrix, b, strict=True)]
    for k in range(len(rows)):
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for j in range(len(rows)):
            if j != k:
                rows[j] = [a - rows[j][k] * c for a, c in zip(rows[j], rows[k], strict=True)]
    return [row[-1] for row in rows]


def test_the_lowest_eigenvalue_has_full_accuracy_beside_much_stiffer_ones() -> None:
    scale = np.array([1.0, 1e6, 3e3])
    stiffness = np.array([[1.0, 0.5, 0.3], [0.5, 1.0, 0.2], [0.3, 0.2, 1.0]]) * np.outer(scale, scale)
    mass = np.array([[2.0, 0.7, 0.4], [0.7, 1.0, 0.6], [0.4, 0.6, 3.0]])
    # Round-off; a solve of K phi = lambda M phi is 60 times farther off even for this small a matrix.
    np.testing.assert_allclose(
        compute_dense_modes(mass, stiffness).lambda_[0], exact_lowest(mass, stiffness), rtol=1e-14
    )


def test_shapes_make_the_shifted_stiffness_the_unit_matrix() -> None:
    a, b = np.random.default_rng(0).standard_normal((2, 8, 8))
    mass, stiffness = a @ a.T + np.eye(8), b @ b.T + np.eye(8)
    modes = compute_dense_modes(mass, stiffness)
    shifted = stiffness + modes.shift * mass
    np.testing.assert_allclose(modes.shapes.T @ shifted @ modes.shapes, np.eye(8), atol=1e-12)
    np.testing.assert_allclose(modes.shapes.T @ mass @ modes.shapes, np.diag(modes.mu), atol=1e-12 * modes.mu[0])
    np.testing.assert_allclose(modes.lambda_, scipy.linalg.eigh(stiffness, mass, eigvals_only=True), rtol=1e-9)


def test_mode_shapes_have_a_unit_mass_and_one_sign() -> None:
    a, b = np.random.default_rng(0).standard_normal((2, 8, 8))
    mass, stiffness = a @ a.T + np.eye(8), b @ b.T + np.eye(8)
    modes = compute_dense_modes(mass, stiffness)
    shapes = modes.mode_shapes
    # Both are of size 100, and a solve loses a few more digits.
    np.testing.assert_allclose(shapes.T @ mass @ shapes, np.eye(8), atol=1e-10)
    np.testing.assert_allclose(stiffness @ shapes, mass @ shapes * modes.lambda_, atol=1e-10)
    np.testing.assert_array_equal(shapes.max(axis=0), np.abs(shapes).max(axis=0))


def test_a_body_without_stiffness_and_an_indefinite_one() -> None:
    np.testing.assert_allclose(compute_dense_modes(np.eye(3), np.zeros((3, 3))).lambda_, 0, atol=1e-15)
    with pytest.raises(np.linalg.LinAlgError, match="indefinite: lowest eigenvalue -1"):
        compute_dense_modes(np.eye(2), np.diag([-1.0, 2.0]))
