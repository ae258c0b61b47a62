"""The low eigenvalues of a stiff matrix keep their digits."""

import numpy as np
import pytest
import scipy.linalg

from fe.dense_modes import dense_modes


@pytest.mark.parametrize("ratio", [1.0, 1e6, 1e12])
def test_the_lowest_eigenvalue_has_full_accuracy_beside_any_stiffer_one(ratio: float) -> None:
    scale = np.array([1.0, np.sqrt(ratio)])
    stiffness = np.array([[1.0, 0.5], [0.5, 1.0]]) * np.outer(scale, scale)
    # Of a quadratic, the form without cancellation.
    trace, determinant = 1 + ratio, 0.75 * ratio
    exact = 2 * determinant / (trace + np.sqrt(trace**2 - 4 * determinant))
    np.testing.assert_allclose(dense_modes(np.eye(2), stiffness).lambda_[0], exact, rtol=1e-14)  # round-off


def test_shapes_make_the_shifted_stiffness_the_unit_matrix() -> None:
    a, b = np.random.default_rng(0).standard_normal((2, 8, 8))
    mass, stiffness = a @ a.T + np.eye(8), b @ b.T + np.eye(8)
    modes = dense_modes(mass, stiffness)
    shifted = stiffness + modes.shift * mass
    np.testing.assert_allclose(modes.shapes.T @ shifted @ modes.shapes, np.eye(8), atol=1e-12)
    np.testing.assert_allclose(modes.shapes.T @ mass @ modes.shapes, np.diag(modes.mu), atol=1e-12 * modes.mu[0])
    np.testing.assert_allclose(modes.lambda_, scipy.linalg.eigh(stiffness, mass, eigvals_only=True), rtol=1e-9)


def test_a_body_without_stiffness_and_an_indefinite_one() -> None:
    np.testing.assert_allclose(dense_modes(np.eye(3), np.zeros((3, 3))).lambda_, 0, atol=1e-15)
    with pytest.raises(np.linalg.LinAlgError, match="indefinite: lowest eigenvalue -1"):
        dense_modes(np.eye(2), np.diag([-1.0, 2.0]))
