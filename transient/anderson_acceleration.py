"""Anderson acceleration of a fixed-point iteration z -> P(z)."""

import numpy as np

from reduction.array_type import Vector

#: Growth of the residual after a jump at which the memory is dropped.
WORSE = 2.0


class AndersonAcceleration:
    """Combines the last `depth` images so that their residuals P(z) - z cancel best; depth 0 does nothing.

    References
    ----------
    Walker and Ni, Anderson acceleration for fixed-point iterations, SIAM Journal on Numerical Analysis 49 (2011).
    """

    def __init__(self, depth: int) -> None:
        self.depth = depth
        self._images: list[Vector] = []
        self._residuals: list[Vector] = []

    def next(self, z: Vector, image: Vector) -> Vector:
        """Next z; `image` itself until there is something to combine."""
        residual = image - z
        if self._residuals and np.linalg.norm(residual) > WORSE * np.linalg.norm(self._residuals[-1]):
            self._images, self._residuals = [], []
        self._images = [*self._images, image][-self.depth - 1 :]
        self._residuals = [*self._residuals, residual][-self.depth - 1 :]
        if self.depth < 1 or len(self._residuals) < 2:
            return image
        residuals = np.diff(np.array(self._residuals), axis=0).T
        weights = np.linalg.lstsq(residuals, residual, rcond=1e-10)[0]
        jumped: Vector = image - np.diff(np.array(self._images), axis=0).T @ weights
        return jumped
