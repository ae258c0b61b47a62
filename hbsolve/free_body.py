"""Test whether a structure is held by joints alone."""

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, eigvalsh
from scipy.linalg.lapack import dpocon

from reduction.array_type import Matrix

#: Reciprocal condition number of a scaled stiffness below which there may be a motion without stiffness.
SINGULAR = 1e-13
#: Stiffness of the structure without its joints against a motion, relative to that with joints, that counts as
#: round-off.
MAX_FREE_STIFFNESS_RATIO = 1e-6


def is_free(stiffness: Matrix, of_joints: Matrix) -> bool:
    """Whether some motion is resisted by joints alone, from the stiffness of structure and joints, shape (r, r) [N/m].

    A Cholesky factor decides for most structures at a tenth of the cost of natural frequencies; for ill-conditioned
    fine meshes the motion of least stiffness decides.
    """
    if not _may_be_free(stiffness):
        return False
    try:
        share = eigvalsh(stiffness, stiffness + of_joints, subset_by_index=[0, 0], check_finite=False)
    except LinAlgError:  # not even joints hold it
        return False
    return bool(share[0] < MAX_FREE_STIFFNESS_RATIO)


def _may_be_free(stiffness: Matrix) -> bool:
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
