r"""Whitening of differences by a covariance of independent noise and of errors common to many features.

.. math:: S = \Lambda + \sum_p g_p g_p^T + \sum_j u_j u_j^T

The modes u_j change all features at once: a shift of all frequencies by the exciter, a change of temperature, or a mesh
that is slightly too stiff. As diagonal noise they would hide true effects; without them false effects would pass. Each
g_p is an error common to a part of the features, such as a section of a curve. Parts do not overlap. There may be many
of them, so that they are sparse.
"""

from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from correlation.errors import CampaignError


class _Stage(NamedTuple):
    """Orthonormal columns, and relative reduction of a difference along each [-]."""

    basis: Any
    shrink: Float[NDArray[np.float64], " j"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Whitening:
    """Covariance of a vector of features, and a root S^(-1/2) of its inverse, symmetric unless there are parts.

    Parameters
    ----------
    deviation
        Square root of Lambda, shape (m,) [unit of each feature].
    modes
        Modes u_j, shape (m, j); none by default.
    parts
        Parts g_p, sparse, shape (m, p); none by default.
    """

    deviation: Float[NDArray[np.float64], " m"]
    modes: Float[NDArray[np.float64], "m j"] | None = None
    parts: Any = None
    _stages: list[_Stage] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.deviation).all() and (self.deviation > 0).all()):
            raise CampaignError("a standard deviation is zero or not finite: repeat the test, or give an uncertainty")
        object.__setattr__(self, "_stages", [])
        if self.parts is not None:
            scaled = self.parts.multiply(1 / self.deviation[:, None]).tocsr()
            size = np.sqrt(np.asarray(scaled.multiply(scaled).sum(axis=0)).ravel())
            basis = scaled.multiply(1 / np.where(size > 0, size, 1.0)).tocsr()
            self._stages.append(_Stage(basis, 1 - 1 / np.sqrt(1 + size**2)))
        if self.modes is not None and self.modes.shape[1]:
            basis, size, _ = np.linalg.svd(self._shrunk(self.modes / self.deviation[:, None]), full_matrices=False)
            self._stages.append(_Stage(basis, 1 - 1 / np.sqrt(1 + size**2)))

    def __call__(self, difference: Float[NDArray[np.float64], "m ..."]) -> Float[NDArray[np.float64], "m ..."]:
        """S^(-1/2) times one difference, shape (m,), or several, shape (m, n)."""
        return self._shrunk(difference / _expand_rows(self.deviation, difference))

    def _shrunk(self, scaled: Float[NDArray[np.float64], "m ..."]) -> Float[NDArray[np.float64], "m ..."]:
        for basis, shrink in self._stages:
            scaled = scaled - basis @ (_expand_rows(shrink, scaled) * (basis.T @ scaled))
        return np.asarray(scaled)

    def unwhiten(self, whitened: Float[NDArray[np.float64], "m ..."]) -> Float[NDArray[np.float64], "m ..."]:
        """S^(1/2) times one difference, shape (m,), or several, shape (m, n): the inverse of a call."""
        for basis, shrink in reversed(self._stages):
            whitened = whitened + basis @ (_expand_rows(shrink / (1 - shrink), whitened) * (basis.T @ whitened))
        return np.asarray(_expand_rows(self.deviation, whitened) * whitened)

    @property
    def total_deviation(self) -> Float[NDArray[np.float64], " m"]:
        """Square root of the diagonal of S, shape (m,) [unit of each feature]."""
        variance = self.deviation**2
        if self.modes is not None:
            variance = variance + (self.modes**2).sum(axis=1)
        if self.parts is not None:
            variance = variance + np.asarray(self.parts.multiply(self.parts).sum(axis=1)).ravel()
        return np.asarray(np.sqrt(variance))

    @property
    def log_determinant(self) -> float:
        """Logarithm of det S."""
        return float(2 * np.log(self.deviation).sum() - 2 * sum(np.log1p(-item.shrink).sum() for item in self._stages))

    def shared(self, numbers: Int[NDArray[np.int64], " n"]) -> Float[NDArray[np.float64], "n c"]:
        """Changes of some features by all common errors, shape (n, c)."""
        modes = np.zeros((len(numbers), 0)) if self.modes is None else self.modes[numbers]
        if self.parts is None:
            return np.asarray(modes)
        own = self.parts[numbers]
        return np.hstack([modes, own[:, np.unique(own.indices)].toarray()])

    def with_modes(self, more: Float[NDArray[np.float64], "m j"]) -> "Whitening":
        """With additional modes after the present ones."""
        return replace(self, modes=more if self.modes is None else np.column_stack([self.modes, more]))

    def explained(self, difference: Float[NDArray[np.float64], "m n"]) -> Float[NDArray[np.float64], "m n"]:
        """Most probable contribution of common errors to differences, shape (m, n)."""
        scaled = difference / self.deviation[:, None]
        left = self._shrunk(scaled)
        for basis, shrink in reversed(self._stages):
            left = left - basis @ (shrink[:, None] * (basis.T @ left))
        return np.asarray(self.deviation[:, None] * (scaled - left))


def _expand_rows(
    scale: Float[NDArray[np.float64], " m"], differences: Float[NDArray[np.float64], "m ..."]
) -> Float[NDArray[np.float64], "m ..."]:
    """Factors of rows, shaped to multiply one difference or several."""
    return scale if differences.ndim == 1 else scale[:, None]
