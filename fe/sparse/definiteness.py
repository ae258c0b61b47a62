"""Check whether a sparse symmetric matrix is positive definite, by its eigenvalues or by a factorisation."""

import numpy as np
import scipy.sparse as sp

from fe.modal import MAX_DENSE
from fe.sparse.solver import Definiteness, SingularMatrix, factorise

#: Eigenvalue of the scaled matrix below which it is zero to working accuracy.
ROUND_OFF = 1e-14


def is_definite(matrix: sp.csr_array, slack: float) -> bool:
    """Whether all eigenvalues of the matrix, scaled to a diagonal of ones, are above -slack.

    Parameters
    ----------
    matrix
        Matrix with a positive diagonal, shape (n, n).
    slack
        Tolerance: if it is positive, a semi-definite matrix passes; if it is 0, a singular matrix fails [-].

    Notes
    -----
    A large matrix is factorised with the slack on its diagonal. SuperLU, which is used without PARDISO and CHOLMOD,
    does not detect negative pivots: a large indefinite matrix may then pass.
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
