"""Rice's distribution: true moduli come back from those of noisy numbers."""

import numpy as np
import pytest
import scipy.stats

from correlation.noise.rice import remove_bias


@pytest.mark.parametrize("modulus", [0.5, 1.0, 3.0, 10.0, 35.0])
def test_the_true_modulus_comes_back(modulus: float) -> None:
    mean, deviation = scipy.stats.rice(modulus).mean(), scipy.stats.rice(modulus).std()
    result = remove_bias(np.array([mean]), np.array([deviation]))
    # Linear between steps of 0.01 of the table.
    assert result == pytest.approx(modulus, rel=1e-4)


def test_noise_alone_and_no_noise() -> None:
    rayleigh = np.sqrt(np.pi / (4 - np.pi))
    result = remove_bias(np.array([0.9 * rayleigh, 2.0, 0.0]), np.array([1.0, 0.0, 1.0]))
    np.testing.assert_array_equal(result, [0.0, 2.0, 0.0])
