"""The most probable coefficients: against closed forms, and bands that hold the truth."""

import numpy as np
import pytest

from diagnosis.missing_law.evidence import compute_posterior

GROUP = np.array([0, 0, 0, 1, 1])
POSITIVE = np.array([False, False, False, True, True])
ONE = np.ones((1, 5), dtype=complex)


def test_sure_data_give_the_coefficients_of_least_squares() -> None:
    random = np.random.default_rng(1)
    changes, true = random.normal(size=(200, 5)) * 1e3, np.array([1.0, -2.0, 0.5, 0.7, 1.5])
    result = compute_posterior(changes, changes @ true, GROUP, POSITIVE, ONE, 200, 1.0)
    # The prior shifts them by sigma^2 over the squares of all data.
    np.testing.assert_allclose(result.mean, true, rtol=1e-5)
    assert result.noise == 1.0


def test_a_coefficient_that_would_be_negative_is_zero() -> None:
    random = np.random.default_rng(2)
    changes, true = random.normal(size=(200, 5)) * 1e3, np.array([1.0, -2.0, 0.5, -0.7, 1.5])
    result = compute_posterior(changes, changes @ true, GROUP, POSITIVE, ONE, 200, 1.0)
    assert result.mean[3] == 0.0
    assert (result.mean[POSITIVE] >= 0).all()


def test_the_scatter_is_that_of_what_is_left() -> None:
    random = np.random.default_rng(3)
    changes = random.normal(size=(400, 5)) * 10
    residual = changes @ np.array([1.0, -2.0, 0.5, 0.7, 1.5]) + 3.0 * random.normal(size=400)
    result = compute_posterior(changes, residual, GROUP, POSITIVE, ONE, 400, 1.0)
    assert np.isclose(result.noise, 3.0, rtol=0.1)  # of 400 numbers: 3.5 % is a standard deviation


@pytest.mark.parametrize("seed", range(3))
def test_bands_hold_the_truth(seed: int) -> None:
    random, inside = np.random.default_rng(seed), []
    for _ in range(100):
        changes, true = random.normal(size=(30, 5)), random.normal(size=5) * 4
        true[POSITIVE] = np.abs(true[POSITIVE])
        result = compute_posterior(changes, changes @ true + random.normal(size=30), GROUP, POSITIVE, ONE, 30, 1.0)
        inside += list(np.abs(result.mean - true)[:3] < 1.96 * np.sqrt(np.diag(result.covariance))[:3])
    assert 0.9 < np.mean(inside) < 0.99  # 300 numbers: 1.3 % is a standard deviation


def test_a_function_that_the_data_do_not_see_is_as_before() -> None:
    random = np.random.default_rng(5)
    changes = random.normal(size=(100, 5)) * 10
    changes[:, 3:] = 0.0
    result = compute_posterior(changes, changes @ np.ones(5), GROUP, POSITIVE, ONE, 100, 1.0)
    assert result.is_seen.tolist() == [True, False]
    np.testing.assert_allclose(np.diag(result.covariance)[3:], result.size[3:] ** 2)
