"""Symmetric root of a covariance.

It makes random draws reproducible. With scaled eigenvectors they would depend on round-off, and hence on the machine:
the signs of eigenvectors, and their order for nearly equal eigenvalues, are arbitrary.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


def symmetric_root(covariance: Float[NDArray[np.float64], "q q"]) -> Float[NDArray[np.float64], "q q"]:
    """Root R = R^T with R R = C, shape (q, q); eigenvalues made negative by round-off count as zero."""
    size, directions = np.linalg.eigh(covariance)
    return np.asarray((directions * np.sqrt(np.maximum(size, 0.0))) @ directions.T)
