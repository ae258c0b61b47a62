"""Whether a sparse matrix is symmetric: of the others, factorisations would take one triangle and not say so."""

from typing import Any

import numpy as np
import scipy.sparse as sp

from fe.factor import Symmetric

#: Asymmetry, against the largest entry, that may be round-off of what a matrix is the sum of.
ROUND_OFF = 1e-10


def check_symmetric(matrix: Symmetric | Any) -> None:
    """Refuse a sparse matrix that is not real, square and symmetric.

    Random numbers are multiplied by it from either side, which takes no copy; what differs shows with probability one.
    Parts and matrices that store one triangle are symmetric as they are.

    Parameters
    ----------
    matrix
        Shape (n, n).

    Raises
    ------
    ValueError
        It is complex, not square, or not symmetric, with the row that shows it best.
    """
    if not sp.issparse(matrix):
        return
    whole: Any = matrix
    if whole.dtype.kind == "c":
        raise ValueError("the matrix is complex: factorise a real one, and give losses as a damping matrix")
    if len(whole.shape) != 2 or whole.shape[0] != whole.shape[1]:
        raise ValueError(f"the matrix has shape {whole.shape}: it must be square")
    if not whole.nnz:
        return
    random = np.random.default_rng(0).standard_normal(whole.shape[0])
    difference = np.abs(whole @ random - random @ whole)
    largest = float(np.abs(whole.data).max())
    # What is no number is left to the factorisation, which tells it.
    if (difference > ROUND_OFF * largest * np.linalg.norm(random)).any():
        row = int(difference.argmax())
        raise ValueError(
            f"the matrix is not symmetric, most clearly in row {row}, counted from 0: give both triangles, and make "
            "follower forces or gyroscopic terms no part of it"
        )
