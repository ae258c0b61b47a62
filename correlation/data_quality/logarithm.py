"""Logarithms of complex ratios: amplitude and phase, whose differences tell a factor and a turn."""

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

Logarithms = Complex[NDArray[np.complex128], "..."]


def turn_phases(logarithm: Logarithms | complex) -> Logarithms:
    """The same with phases on the turn about zero, shape as given.

    Parameters
    ----------
    logarithm
        Logarithms of ratios, their phases in radians.
    """
    values = np.asarray(logarithm)
    return np.asarray(values.real + 1j * ((values.imag + np.pi) % (2 * np.pi) - np.pi))
