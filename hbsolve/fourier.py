r"""The Fourier convention of this package.

A periodic motion of the angular frequency Omega is

.. math:: q(t) = \Re \sum_{k=0}^{H} q_k\, e^{i k \Omega t}

so that `coefficients[k]` is q_k: a complex amplitude without a factor 1/2, and `coefficients[0]` is the mean, which is
real. The first axis counts harmonics from 0 to H, n_harmonic = H + 1. Written with cosines and sines,
q_k = Q_k^c - i Q_k^s for q(t) = Q_0 + sum Q_k^c cos(k Omega t) + Q_k^s sin(k Omega t), which is also the convention of
Krack and Gross's NLvib, and eq. 4 of the paper. A derivative in time multiplies q_k by i k Omega.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 4 and 5.
Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer (2019), chapter 2.
"""

import numpy as np
from jaxtyping import Complex, Float

from geometry.errors import InputError
from reduction.array_type import Array, Real

Coefficients = Complex[Array, "harmonic ..."]
Samples = Float[Real, "sample ..."]


def harmonics(angular_frequency: float, n_harmonic: int) -> Float[Real, " harmonic"]:
    """Angular frequencies k Omega of harmonics 0 to H = n_harmonic - 1, shape (n_harmonic,) [rad/s]."""
    return np.asarray(angular_frequency * np.arange(n_harmonic), dtype=np.float64)


def samples_from_coefficients(coefficients: Coefficients, n_sample: int) -> Samples:
    """Values of a motion at n_sample equidistant instants of one period, t_j = j T / n_sample.

    Parameters
    ----------
    coefficients
        q_k, shape (n_harmonic, ...) [any unit].
    n_sample
        Number of instants, at least 2 H + 1, so that no harmonic is folded onto another [-].

    Returns
    -------
    Values, shape (n_sample, ...) [the same unit].

    Raises
    ------
    InputError
        Too few samples for the harmonics, or no harmonic at all.
    """
    _check(len(coefficients), n_sample)
    # irfft mirrors all harmonics but the mean, so those carry half.
    halved = np.array(coefficients, dtype=np.complex128) * (n_sample / 2)
    halved[0] *= 2
    return np.asarray(np.fft.irfft(halved, n_sample, axis=0))


def _check(n_harmonic: int, n_sample: int) -> None:
    if n_harmonic < 1:
        raise InputError(f"n_harmonic = {n_harmonic} must be at least 1: it counts the mean and harmonics 1 to H")
    if n_sample < 2 * n_harmonic - 1:
        raise InputError(
            f"{n_sample} samples per period cannot hold harmonics 0 to {n_harmonic - 1}: "
            f"take at least {2 * n_harmonic - 1}"
        )
