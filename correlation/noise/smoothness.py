r"""Noise of a single curve from its roughness.

A response is a smooth function of frequency, noise is not. At each point the value is interpolated by a cubic from the
two points on either side; the difference has the variance :math:`\sigma_i^2 + \sum_j w_j^2 \sigma_j^2`. A resonance
only a few points wide is not smooth, but its inverse :math:`1 / X` is; for an antiresonance the reverse is true. At
each point the smaller of both differences is used, in units of its noise. The variance :math:`a^2 |X|^2 + b^2` is
fitted robustly, so that a jump or a kink does not count as noise.

References
----------
T. Gasser, L. Sroka and C. Jennen-Steinmetz, Residual variance and residual pattern in nonlinear regression,
Biometrika 73 (1986), 625-633: noise from what neighbours do not interpolate.
"""

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.noise.variance import fit_variance_law

#: Neighbours that interpolate a point, as steps from it, and least number of points for an estimate of the noise.
NEIGHBOURS, FEWEST = (-2, -1, 1, 2), 7
#: Powers of a value that are smooth at a resonance, by the number of parts of a value: 1 / X is linear near one mode,
#: 1 / |X|^2 a parabola.
SMOOTH = {2: (-1,), 1: (-1, -2)}
#: Least noise over the largest value of a curve: values are written with six digits or more [-].
EXACT = 1e-7
#: Share of independent differences: neighbouring ones have common readings, so that half of them are independent.
INDEPENDENT = 0.5

Curve = Complex[NDArray[np.complex128], " n"]


def estimate_curve_noise(
    frequency: Float[NDArray[np.float64], " n"], value: Curve, *, parts: int = 2
) -> tuple[Float[NDArray[np.float64], " n"], float]:
    """Standard deviation of the noise of each point of one curve, and its degrees of freedom.

    Parameters
    ----------
    frequency
        Frequencies, ascending, shape (n,) [Hz].
    value
        Values without gaps, shape (n,).
    parts
        Parts of each value: 2 for complex values, 1 for amplitudes and static parts.

    Returns
    -------
    Standard deviation of the real and of the imaginary part, shape (n,) [unit of the values], and the degrees of
    freedom of its square; NaN and 0 for fewer than `FEWEST` points, or if all values are zero.
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
    """Indices of the points with two neighbours on either side, and the estimate of the squared noise at each, (i,)."""
    inner = np.arange(2, len(value) - 2)
    near = inner[:, None] + np.array(NEIGHBOURS)
    weights = _compute_weights(frequency[inner], frequency[near])
    squares = np.abs(value[inner] - (weights * value[near]).sum(axis=1)) ** 2 / (1 + (weights**2).sum(axis=1))
    for power in SMOOTH[parts]:
        # The noise of the neighbours is assumed to be the same share of their values.
        with np.errstate(divide="ignore", invalid="ignore"):
            share = weights * (value[near] / value[inner, None]) ** power
            apart = np.abs(value[inner] * (1 - share.sum(axis=1)) / power) ** 2
            squares = np.fmin(squares, apart / (1 + (np.abs(share) ** 2).sum(axis=1)))
    return inner, squares


def _compute_weights(
    at: Float[NDArray[np.float64], " i"], nodes: Float[NDArray[np.float64], "i j"]
) -> Float[NDArray[np.float64], "i j"]:
    """Lagrange interpolation weights at one position per row, shape (i, j)."""
    weights = np.ones_like(nodes)
    for number in range(nodes.shape[1]):
        for other in range(nodes.shape[1]):
            if other != number:
                weights[:, number] *= (at - nodes[:, other]) / (nodes[:, number] - nodes[:, other])
    return weights
