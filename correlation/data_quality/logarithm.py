"""Logarithms of complex ratios: the real part is that of a gain, the imaginary part a phase."""

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

Logarithms = Complex[NDArray[np.complex128], "..."]


def wrap_phases(logarithm: Logarithms | complex) -> Logarithms:
    """Wrap the phases to [-pi, pi), shape as given.

    Parameters
    ----------
    logarithm
        Logarithms of ratios, their phases in radians.
    """
    values = np.asarray(logarithm)
    return np.asarray(values.real + 1j * ((values.imag + np.pi) % (2 * np.pi) - np.pi))
