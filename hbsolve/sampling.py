"""The instants of one period and the real Fourier basis on them, as arrays for compiled code.

In compiled code a motion is real: row d of x holds [q_0, Q_1^c, Q_1^s, Q_2^c, ...] of direction d, with
q_k = Q_k^c - i Q_k^s (`hbsolve.fourier`), so nh = 2 H + 1 columns.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from fe.compiled import compiled
from reduction.array_type import Array, Real


class Sampling(NamedTuple):
    """Basis and weights at n equidistant instants of a period; nh = 2 H + 1."""

    evaluate: Real
    """Cosines and sines: x times this is u(t), shape (nh, n)."""
    differentiate: Real
    """Their derivatives: x times this is du/d(Omega t), shape (nh, n)."""
    project: Real
    """Projection: u(t) times this is x, shape (n, nh)."""
    instants: Real
    """Transpose of `evaluate`, shape (n, nh)."""
    projected_sum: Real
    """Running sums of `project`: a run [k, l) of instants sums to row l less row k, shape (n + 1, nh)."""
    cosine_sum: Real
    sine_sum: Real
    """Running sums of cos(m Omega t) and sin(m Omega t), m = 0 to 2 H, shape (n + 1, nh), for `add_products`."""


@lru_cache(maxsize=8)
def sampling(n_harmonic: int, n_sample: int) -> Sampling:
    """Basis for harmonics 0 to H = n_harmonic - 1 at n_sample instants; cached, since many points share it."""
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
    twice = angle[:, None] * np.arange(nh)
    projected_sum, cosine_sum, sine_sum = (np.zeros((n_sample + 1, nh)) for _ in range(3))
    np.cumsum(project, axis=0, out=projected_sum[1:])
    np.cumsum(np.cos(twice), axis=0, out=cosine_sum[1:])
    np.cumsum(np.sin(twice), axis=0, out=sine_sum[1:])
    return Sampling(evaluate, differentiate, project, instants, projected_sum, cosine_sum, sine_sum)


@compiled
def add_sums(factor: float, sampling: Any, first: int, last: int, cosine: Any, sine: Any) -> None:
    """Add a factor times the sums of cos(m Omega t) and sin(m Omega t) over the instants [first, last)."""
    for m in range(len(cosine)):
        cosine[m] += factor * (sampling.cosine_sum[last, m] - sampling.cosine_sum[first, m])
        sine[m] += factor * (sampling.sine_sum[last, m] - sampling.sine_sum[first, m])


@compiled
def add_products(cosine: Any, sine: Any, n: int, result: Any) -> None:
    """Add the sum of the outer products of `project` and `instants` over some instants, shape (nh, nh).

    Products of sines and cosines are sums of sines and cosines, so that no sum of nh x nh products is stored for each
    instant: `cosine` and `sine` are the sums over these of the n instants, possibly weighted (`add_sums`).
    """
    c, s = cosine / n, sine / n
    result[0, 0] += c[0]
    for j in range(1, (len(c) + 1) // 2):
        a, b = 2 * j - 1, 2 * j
        result[0, a] += c[j]
        result[0, b] += s[j]
        result[a, 0] += 2 * c[j]
        result[b, 0] += 2 * s[j]
        for k in range(1, (len(c) + 1) // 2):
            both, apart = j + k, abs(j - k)
            difference = s[apart] if j > k else -s[apart]
            result[a, 2 * k - 1] += c[apart] + c[both]
            result[a, 2 * k] += s[both] - difference
            result[b, 2 * k - 1] += s[both] + difference
            result[b, 2 * k] += c[apart] - c[both]


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
