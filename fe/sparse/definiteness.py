"""Whether a sparse symmetric matrix is positive definite, by its eigenvalues or by a factorisation."""

import numpy as np
import scipy.sparse as sp

from fe.modal import MAX_DENSE
from fe.sparse.solver import Definiteness, SingularMatrix, factorise

#: Eigenvalues of the scaled matrix below this are zero to working accuracy.
ROUND_OFF = 1e-14


def is_definite(matrix: sp.csr_array, slack: float) -> bool:
    """Whether the matrix, scaled to a diagonal of ones, has eigenvalues above -slack alone.

    Parameters
    ----------
    matrix
        Shape (n, n), its diagonal positive.
    slack
        Above 0 a semi-definite matrix passes [-]; at 0 a singular one does not.

    Notes
    -----
    A large matrix is factorised with the slack on its diagonal. SuperLU, where PARDISO is not installed, does not
    notice a negative pivot: a large indefinite matrix may pass there.
    """
    scale = sp.diags_array(1 / np.sqrt(matrix.diagonal()))
    scaled = sp.csr_array(scale @ matrix @ scale)
    if scaled.shape[0] <= MAX_DENSE:
        return bool(np.linalg.eigvalsh(scaled.toarray())[0] > ROUND_OFF - slack)
    try:
        factorise(sp.csr_array(scaled + slack * sp.eye_array(scaled.shape[0])), Definiteness.POSITIVE)
    except SingularMatrix:
        return False
    return True
