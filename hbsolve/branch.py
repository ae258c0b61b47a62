"""A curve of periodic responses."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseBranch:
    """Periodic responses along a curve; arrays are copied and read-only.

    Parameters
    ----------
    angular_frequency
        Omega of each point, shape (p,) [rad/s].
    coefficients
        In the convention of `hbsolve.fourier`, shape (p, n_harmonic, r) [m].
    residual_norm
        Unbalanced force relative to the excitation, in the Euclidean norm over harmonics and degrees of freedom,
        shape (p,) [-].
    stop_reason
        Why the curve ends where it ends, in words.
    """

    angular_frequency: Float[NDArray[np.float64], " p"]
    coefficients: Complex[NDArray[np.complex128], "p harmonic r"]
    residual_norm: Float[NDArray[np.float64], " p"]
    stop_reason: str

    def __post_init__(self) -> None:
        for name, kind in (("angular_frequency", float), ("coefficients", complex), ("residual_norm", float)):
            values = np.array(getattr(self, name), dtype=kind)
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    @property
    def frequency(self) -> Float[NDArray[np.float64], " p"]:
        """Excitation frequencies, shape (p,) [Hz]."""
        return np.asarray(self.angular_frequency / (2 * np.pi))

    def amplitude(self, row: int, harmonic: int = 1) -> Float[NDArray[np.float64], " p"]:
        """Amplitude of one harmonic of one degree of freedom, shape (p,) [m]."""
        return np.asarray(np.abs(self.coefficients[:, harmonic, row]))
