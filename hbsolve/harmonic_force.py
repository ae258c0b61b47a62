"""A periodic excitation."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from hbsolve.errors import ForceError


@dataclass(frozen=True, kw_only=True, eq=False)
class HarmonicForce:
    """Fourier coefficients of an excitation, in the convention of `hbsolve.fourier`.

    Parameters
    ----------
    coefficients
        Shape (n_harmonic, r) [N]: harmonic 0 (the static load, real), 1, ..., H on each degree of freedom.

    Raises
    ------
    ForceError
        Another shape, a value that is not finite, or a static load that is not real.
    """

    coefficients: Complex[NDArray[np.complex128], "harmonic r"]

    def __post_init__(self) -> None:
        coefficients = np.array(self.coefficients, dtype=np.complex128)
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)
        if coefficients.ndim != 2 or not coefficients.size:
            raise ForceError(
                f"force coefficients have shape {coefficients.shape}: give (n_harmonic, degrees of freedom)"
            )
        if not np.isfinite(coefficients).all():
            harmonic, row = np.argwhere(~np.isfinite(coefficients))[0]
            raise ForceError(
                f"the force is {coefficients[harmonic, row]} N in harmonic {harmonic} on row {row}: give finite numbers"
            )
        if np.any(coefficients[0].imag != 0):
            row = int(np.flatnonzero(coefficients[0].imag)[0])
            raise ForceError(
                f"the static force on row {row} is {coefficients[0, row]:g} N: harmonic 0 is a mean and must be real"
            )

    @property
    def n_harmonic(self) -> int:
        """H + 1: the mean counts [-]."""
        return len(self.coefficients)
