r"""Bias of the moduli of noisy complex numbers (Rice distribution).

Without motion, noise with the standard deviation :math:`\sigma` in each part gives a mean modulus of
:math:`\sigma \sqrt{\pi / 2}`. With :math:`\theta` the true modulus over :math:`\sigma`, the variance of a modulus is
:math:`\xi(\theta)\, \sigma^2` and its mean square :math:`(\theta^2 + 2)\, \sigma^2`, so that

.. math:: \theta^2 = \xi(\theta) \left(1 + \frac{\text{mean}^2}{\text{variance}}\right) - 2, \qquad
          \xi = 2 + \theta^2 - \frac{\pi}{8}\, e^{-\theta^2 / 2}
          \left((2 + \theta^2) I_0(\theta^2 / 4) + \theta^2 I_1(\theta^2 / 4)\right)^2 .

References
----------
Koay and Basser, Analytically exact correction scheme for signal extraction from noisy magnitude MR signals, J. Magn.
Reson. 179 (2006), 317-322.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import i0e, i1e

Vector = Float[NDArray[np.float64], " m"]

#: theta at which the equation is tabulated; beyond, xi is 1 - 1 / (2 theta^2), and theta^2 = ratio - 3 / 2.
TABLE = np.linspace(0.0, 30.0, 3001)


def remove_bias(mean: Vector, deviation: Vector) -> Vector:
    """Moduli without the bias by noise.

    Parameters
    ----------
    mean, deviation
        Mean of the moduli, and standard deviation of one of them, shape (m,) [any unit].

    Returns
    -------
    Moduli, shape (m,); zero where noise alone explains the mean.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (mean / deviation) ** 2
    noisy = np.isfinite(ratio)
    ratio = np.where(noisy, ratio, 0.0)
    known = (TABLE**2 + 2) / _share(TABLE**2) - 1
    theta = np.where(ratio < known[-1], np.interp(ratio, known, TABLE), np.sqrt(np.maximum(ratio - 1.5, 0.0)))
    return np.where(noisy, theta / np.sqrt(_share(theta**2)) * deviation, mean)


def _share(squared: Vector) -> Vector:
    """Xi of theta^2: variance of a modulus over that of one part of the noise."""
    half = (2 + squared) * i0e(squared / 4) + squared * i1e(squared / 4)
    return np.asarray(2 + squared - np.pi / 8 * half**2)
