"""The Fourier convention."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry.errors import InputError
from hbsolve.fourier import harmonics, samples_from_coefficients

# An FFT of a few hundred numbers near one.
ROUND_OFF = 1e-13


def motion(seed: int, n_harmonic: int, shape: tuple[int, ...] = (2, 3)) -> np.ndarray:
    real, imaginary = np.random.default_rng(seed).standard_normal((2, n_harmonic, *shape))
    imaginary[0] = 0
    return real + 1j * imaginary


@given(seed=st.integers(0, 2**32 - 1), order=st.integers(0, 20), spare=st.integers(0, 90))
def test_parseval(seed: int, order: int, spare: int) -> None:
    q = motion(seed, order + 1)
    mean_square = np.mean(samples_from_coefficients(q, 2 * order + 1 + spare) ** 2, axis=0)
    np.testing.assert_allclose(mean_square, np.abs(q[0]) ** 2 + np.sum(np.abs(q[1:]) ** 2, axis=0) / 2, rtol=1e-12)


@given(seed=st.integers(0, 2**32 - 1), order=st.integers(0, 20), spare=st.integers(0, 90))
def test_samples_are_the_real_part_of_the_sum(seed: int, order: int, spare: int) -> None:
    q, n = motion(seed, order + 1, ()), 2 * order + 1 + spare
    time = np.arange(n) / n
    expected = np.real(sum(q[k] * np.exp(2j * np.pi * k * time) for k in range(order + 1)))
    np.testing.assert_allclose(samples_from_coefficients(q, n), expected, atol=ROUND_OFF)


def test_a_coefficient_is_cosine_minus_i_sine() -> None:
    phase = 2 * np.pi * np.arange(16) / 16
    samples = samples_from_coefficients(np.array([5, 2 - 3j, 0, 7j]), 16)
    expected = 5 + 2 * np.cos(phase) + 3 * np.sin(phase) - 7 * np.sin(3 * phase)
    np.testing.assert_allclose(samples, expected, atol=ROUND_OFF)


def test_harmonics_are_multiples_of_the_excitation() -> None:
    np.testing.assert_array_equal(harmonics(3.0, 4), [0, 3, 6, 9])


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(InputError, match="6 samples per period cannot hold harmonics 0 to 3: take at least 7"):
        samples_from_coefficients(motion(0, 4), 6)
    with pytest.raises(InputError, match="n_harmonic = 0 must be at least 1"):
        samples_from_coefficients(motion(0, 4)[:0], 4)
