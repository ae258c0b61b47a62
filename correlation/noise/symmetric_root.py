"""Symmetric root of a covariance.

Any other root, such as that of Cholesky or scaled eigenvectors, turns random numbers that are drawn by it: the signs of
eigenvectors, and their order where eigenvalues are alike, are those of round-off, and another machine would draw other
numbers.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


def symmetric_root(covariance: Float[NDArray[np.float64], "q q"]) -> Float[NDArray[np.float64], "q q"]:
    """Root R = R^T with R R = C, shape (q, q); eigenvalues that round-off makes negative count as zero."""
    size, directions = np.linalg.eigh(covariance)
    return np.asarray((directions * np.sqrt(np.maximum(size, 0.0))) @ directions.T)
