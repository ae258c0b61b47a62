r"""Noise of a single curve: what is left of it when everything smooth has been taken away.

A response over the frequency is smooth, noise is not. At each point the value is interpolated by a cubic from the two
points on either side; the difference has the variance :math:`\sigma_i^2 + \sum_j w_j^2 \sigma_j^2`. A resonance that
is as narrow as a few points is not smooth, but its inverse :math:`1 / X` is; an antiresonance the other way round. Each
point counts by the smaller of both differences, in units of its noise. The variance
:math:`a^2 |X|^2 + b^2` is fitted robustly, so that a jump or a kink does not count as noise.

References
----------
T. Gasser, L. Sroka and C. Jennen-Steinmetz, Residual variance and residual pattern in nonlinear regression,
Biometrika 73 (1986), 625-633: noise from what neighbours do not interpolate.
"""

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.noise.variance import fit_variance_law

#: Neighbours that interpolate a point, as steps from it, and the fewest points of a curve that tell its noise.
NEIGHBOURS, FEWEST = (-2, -1, 1, 2), 7
#: Powers of a value that a resonance leaves smooth, by the numbers of each value: 1 / X is linear near one mode,
#: 1 / |X|^2 a parabola.
SMOOTH = {2: (-1,), 1: (-1, -2)}
#: A curve is never smoother than this share of its largest value: numbers are written with six digits or more [-].
EXACT = 1e-7
#: Differences of neighbouring points share readings: of five points about two and a half are independent.
INDEPENDENT = 0.5

Curve = Complex[NDArray[np.complex128], " n"]


def estimate_curve_noise(
    frequency: Float[NDArray[np.float64], " n"], value: Curve, *, parts: int = 2
) -> tuple[Float[NDArray[np.float64], " n"], float]:
    """Standard deviation of the noise of each point of one curve, and how surely it is known.

    Parameters
    ----------
    frequency
        Rising, shape (n,) [Hz].
    value
        Values without gaps, shape (n,).
    parts
        Numbers of each value: 2 for complex ones, 1 for amplitudes and static parts.

    Returns
    -------
    Standard deviation of the real and the imaginary part alike, shape (n,) [unit of the values], and the degrees of
    freedom of its square; NaN and 0 of fewer than `FEWEST` points, and of zeros, which are no readings.
    """
    if len(value) < FEWEST or not value.any():
        return np.full(len(value), np.nan), 0.0
    inner, squares = measure_roughness(frequency, value, parts=parts)
    size = np.abs(value) ** 2
    dof = np.full(len(inner), float(parts))
    floor = (EXACT * float(np.abs(value).max())) ** 2
    a2, b2 = fit_variance_law(size[inner], np.maximum(squares / parts, floor), dof)
    return np.sqrt(np.maximum(a2 * size + b2, floor)), INDEPENDENT * parts * len(inner)


def measure_roughness(
    frequency: Float[NDArray[np.float64], " n"], value: Curve, *, parts: int = 2
) -> tuple[Int[NDArray[np.int64], " i"], Float[NDArray[np.float64], " i"]]:
    """Indices of the points that have two on either side, and the squared noise that each shows, shape (i,)."""
    inner = np.arange(2, len(value) - 2)
    near = inner[:, None] + np.array(NEIGHBOURS)
    weights = _weights(frequency[inner], frequency[near])
    squares = np.abs(value[inner] - (weights * value[near]).sum(axis=1)) ** 2 / (1 + (weights**2).sum(axis=1))
    for power in SMOOTH[parts]:
        # Noise counts as the same share of the value at the neighbours.
        with np.errstate(divide="ignore", invalid="ignore"):
            share = weights * (value[near] / value[inner, None]) ** power
            apart = np.abs(value[inner] * (1 - share.sum(axis=1)) / power) ** 2
            squares = np.fmin(squares, apart / (1 + (np.abs(share) ** 2).sum(axis=1)))
    return inner, squares


def _weights(
    at: Float[NDArray[np.float64], " i"], nodes: Float[NDArray[np.float64], "i j"]
) -> Float[NDArray[np.float64], "i j"]:
    """Lagrange's weights of interpolation at one place of each row, shape (i, j)."""
    weights = np.ones_like(nodes)
    for number in range(nodes.shape[1]):
        for other in range(nodes.shape[1]):
            if other != number:
                weights[:, number] *= (at - nodes[:, other]) / (nodes[:, number] - nodes[:, other])
    return weights
