"""Whether a stiffness leaves rigid-body motions free."""

import numpy as np
from scipy.linalg import LinAlgError, cho_factor
from scipy.linalg.lapack import dpocon

from reduction.array_type import Matrix

#: Reciprocal condition number of a scaled stiffness at which nothing but round-off resists some motion.
SINGULAR = 1e-13


def is_free(stiffness: Matrix) -> bool:
    """Whether some motion finds no resistance, of a symmetric stiffness of shape (r, r) [N/m].

    A Cholesky factor tells it at a tenth of the cost of natural frequencies.
    """
    diagonal = np.diag(stiffness)
    if not (diagonal > 0).all():
        return True
    root = np.sqrt(diagonal)
    scaled = stiffness / np.outer(root, root)
    try:
        factor, lower = cho_factor(scaled, check_finite=False)
    except LinAlgError:
        return True
    reciprocal, _ = dpocon(factor, np.abs(scaled).sum(axis=0).max(), uplo="L" if lower else "U")
    return bool(reciprocal < SINGULAR)
