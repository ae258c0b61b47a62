"""The root of a covariance is symmetric, and does not depend on the signs of eigenvectors."""

import numpy as np
import pytest

from correlation.noise.symmetric_root import symmetric_root


def test_the_square_of_the_root_is_the_covariance() -> None:
    columns = np.random.default_rng(1).standard_normal((5, 3))
    covariance = columns @ columns.T  # of rank 3: two eigenvalues are round-off
    root = symmetric_root(covariance)
    np.testing.assert_allclose(root, root.T, atol=1e-12)
    np.testing.assert_allclose(root @ root, covariance, atol=1e-12)


def test_the_signs_of_eigenvectors_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    columns, eigh = np.random.default_rng(1).standard_normal((5, 5)), np.linalg.eigh
    covariance = columns @ columns.T
    root = symmetric_root(covariance)
    monkeypatch.setattr(np.linalg, "eigh", lambda matrix: (eigh(matrix)[0], eigh(matrix)[1] * [1, -1, 1, -1, -1]))
    np.testing.assert_array_equal(symmetric_root(covariance), root)
