r"""Whitening: differences in standard deviations, by the noise of each number and errors that many numbers share.

.. math:: S = \Lambda + \sum_j u_j u_j^T

The modes u_j are changes of all numbers at once, by a shift of all frequencies by the exciter, a change of temperature,
or a mesh that is a little too stiff. As diagonal noise they would hide real effects; without them false ones would
pass.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError


@dataclass(frozen=True, kw_only=True, eq=False)
class Whitening:
    """Covariance of a vector of features, and S^(-1/2).

    Parameters
    ----------
    deviation
        Square root of Lambda, shape (m,) [unit of each feature].
    modes
        Shape (m, j); none by default.
    """

    deviation: Float[NDArray[np.float64], " m"]
    modes: Float[NDArray[np.float64], "m j"] | None = None
    _basis: Float[NDArray[np.float64], "m j"] = field(init=False, repr=False)
    _shrink: Float[NDArray[np.float64], " j"] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.deviation).all() and (self.deviation > 0).all()):
            raise CampaignError("a standard deviation is zero or not finite: repeat the test, or give an uncertainty")
        modes = np.zeros((len(self.deviation), 0)) if self.modes is None else self.modes
        basis, size, _ = np.linalg.svd(modes / self.deviation[:, None], full_matrices=False)
        object.__setattr__(self, "_basis", basis)
        object.__setattr__(self, "_shrink", 1 - 1 / np.sqrt(1 + size**2))

    def __call__(self, difference: Float[NDArray[np.float64], "m ..."]) -> Float[NDArray[np.float64], "m ..."]:
        """S^(-1/2) times one difference, shape (m,), or several, shape (m, n)."""
        scale = self.deviation if difference.ndim == 1 else self.deviation[:, None]
        scaled = difference / scale
        shrink = self._shrink if difference.ndim == 1 else self._shrink[:, None]
        return np.asarray(scaled - self._basis @ (shrink * (self._basis.T @ scaled)))

    def undo(self, whitened: Float[NDArray[np.float64], "m ..."]) -> Float[NDArray[np.float64], "m ..."]:
        """S^(1/2) times one difference, shape (m,), or several, shape (m, n): the inverse of a call."""
        one = whitened.ndim == 1
        scale = self.deviation if one else self.deviation[:, None]
        stretch = self._shrink / (1 - self._shrink)
        along = (stretch if one else stretch[:, None]) * (self._basis.T @ whitened)
        return np.asarray(scale * (whitened + self._basis @ along))

    @property
    def total_deviation(self) -> Float[NDArray[np.float64], " m"]:
        """Square root of the diagonal of S, shape (m,) [unit of each feature]."""
        squares = 0.0 if self.modes is None else (self.modes**2).sum(axis=1)
        return np.asarray(np.sqrt(self.deviation**2 + squares))

    @property
    def log_determinant(self) -> float:
        """Logarithm of det S."""
        return float(2 * np.log(self.deviation).sum() - 2 * np.log1p(-self._shrink).sum())

    def with_modes(self, more: Float[NDArray[np.float64], "m j"]) -> "Whitening":
        """With more modes, after those that there are."""
        modes = more if self.modes is None else np.column_stack([self.modes, more])
        return Whitening(deviation=self.deviation, modes=modes)

    def explained(self, difference: Float[NDArray[np.float64], "m n"]) -> Float[NDArray[np.float64], "m n"]:
        """Most probable part of differences along the modes, shape (m, n)."""
        along = self._basis.T @ (difference / self.deviation[:, None])
        return np.asarray(self.deviation[:, None] * (self._basis @ ((1 - (1 - self._shrink) ** 2)[:, None] * along)))

    def sample(self, generator: np.random.Generator) -> Float[NDArray[np.float64], " m"]:
        """A random difference with this covariance, normally distributed."""
        drawn = self.deviation * generator.standard_normal(len(self.deviation))
        if self.modes is not None:
            drawn += self.modes @ generator.standard_normal(self.modes.shape[1])
        return drawn
