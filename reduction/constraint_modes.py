"""Constraint modes: the static shape of the interior when one boundary degree of freedom moves by one."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

from fe.sparse_solver import Factor

#: Right-hand sides solved at once: enough for the solver's block kernels, few enough for its work arrays.
BLOCK = 64


def constraint_modes(factor: Factor, stiffness_boundary_interior: sp.csr_array) -> Float[NDArray[np.float64], "i b"]:
    r"""Interior displacement for a unit displacement of each boundary degree of freedom, no force on the interior.

    .. math:: \Psi = -K_{ii}^{-1} K_{ib}

    Parameters
    ----------
    factor
        Of the interior stiffness K_ii.
    stiffness_boundary_interior
        K_bi = K_ib^T, shape (b, i) [N/m].

    Returns
    -------
    Shape (i, b) [-]; with the boundary's own unit displacements it reproduces every rigid-body motion.

    References
    ----------
    Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968), eq. 5.
    """
    n_boundary, n_interior = stiffness_boundary_interior.shape
    shapes = np.empty((n_interior, n_boundary), order="F")
    for first in range(0, n_boundary, BLOCK):
        block = slice(first, min(first + BLOCK, n_boundary))
        shapes[:, block] = -factor.solve(stiffness_boundary_interior[block].toarray().T)
    return shapes
