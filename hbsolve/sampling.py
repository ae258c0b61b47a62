"""The instants of one period and the real Fourier basis on them, as the compiled code wants it.

Inside the compiled code a motion is real: row d of x holds [q_0, Q_1^c, Q_1^s, Q_2^c, ...] of direction d, with
q_k = Q_k^c - i Q_k^s (`hbsolve.fourier`), so nh = 2 H + 1 columns.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from reduction.array_type import Array, Real


class Sampling(NamedTuple):
    """Basis and weights at n equidistant instants of a period; nh = 2 H + 1."""

    evaluate: Real
    """Row b of x times this is u(t): cosines and sines, shape (nh, n)."""
    differentiate: Real
    """The same for du/d(Omega t), shape (nh, n)."""
    project: Real
    """u(t) times this is x, shape (n, nh)."""
    instants: Real
    """`evaluate` by instant, shape (n, nh)."""
    projected_sum: Real
    """Running sums of `project`: a run [k, l) of instants sums to row l less row k, shape (n + 1, nh)."""
    product_sum: Real
    """Running sums of the outer products of `project` and `instants`, shape (n + 1, nh, nh)."""


@lru_cache(maxsize=8)
def sampling(n_harmonic: int, n_sample: int) -> Sampling:
    """Basis for harmonics 0 to H = n_harmonic - 1 at n_sample instants; stored, since many points share it."""
    angle = 2 * np.pi * np.arange(n_sample) / n_sample
    k = np.arange(1, n_harmonic)[:, None]
    evaluate = np.ones((2 * n_harmonic - 1, n_sample))
    differentiate = np.zeros_like(evaluate)
    evaluate[1::2], evaluate[2::2] = np.cos(k * angle), np.sin(k * angle)
    differentiate[1::2], differentiate[2::2] = -k * np.sin(k * angle), k * np.cos(k * angle)
    project = np.ascontiguousarray(evaluate.T) * (2 / n_sample)
    project[:, 0] /= 2
    instants = np.ascontiguousarray(evaluate.T)
    nh = len(evaluate)
    projected_sum, product_sum = np.zeros((n_sample + 1, nh)), np.zeros((n_sample + 1, nh, nh))
    np.cumsum(project, axis=0, out=projected_sum[1:])
    np.cumsum(project[:, :, None] * instants[:, None, :], axis=0, out=product_sum[1:])
    return Sampling(evaluate, differentiate, project, instants, projected_sum, product_sum)


def real_from_complex(coefficients: Complex[Array, "*batch harmonic d"]) -> Float[Real, "*batch d nh"]:
    """Coefficients q_k of each direction as rows [q_0, Q_1^c, Q_1^s, ...], shape (..., d, 2 H + 1)."""
    *batch, n_harmonic, n_direction = coefficients.shape
    x = np.empty((*batch, n_direction, 2 * n_harmonic - 1))
    higher = np.swapaxes(coefficients[..., 1:, :], -1, -2)
    x[..., 0] = coefficients[..., 0, :].real
    x[..., 1::2], x[..., 2::2] = higher.real, -higher.imag
    return x


def complex_from_real(x: Float[Real, "*batch d nh"]) -> Complex[Array, "*batch harmonic d"]:
    """The inverse of `real_from_complex`, shape (..., H + 1, d)."""
    *batch, n_direction, nh = x.shape
    coefficients = np.empty((*batch, (nh + 1) // 2, n_direction), dtype=np.complex128)
    coefficients[..., 0, :] = x[..., 0]
    coefficients[..., 1:, :] = np.swapaxes(x[..., 1::2] - 1j * x[..., 2::2], -1, -2)
    return coefficients
