"""Constraint modes: the static shape of the interior when one boundary degree of freedom moves by one."""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

from fe.sparse.solver import Factor

#: Right-hand sides solved at once: groups of as many as solvers like best, at least and at most so many groups, and not
#: more memory than this [byte], which the solution and the solver's own arrays take again.
GROUP, LEAST, MOST, MEMORY = 24, 1, 3, 1.5e8


def constraint_modes(
    factor: Factor, stiffness_boundary_interior: sp.csr_array
) -> Iterator[tuple[slice, Float[NDArray[np.float64], "i k"]]]:
    r"""Interior displacement for a unit displacement of each boundary degree of freedom, no force on the interior.

    .. math:: \Psi = -K_{ii}^{-1} K_{ib}

    Parameters
    ----------
    factor
        Of the interior stiffness K_ii.
    stiffness_boundary_interior
        K_bi = K_ib^T, shape (b, i) [N/m].

    Yields
    ------
    Some boundary degrees of freedom, 24 to 72 by the memory that they need, and their columns of Psi, shape (i, k) [-],
    until the next ones take their place; with the boundary's own unit displacements all of them reproduce every
    rigid-body motion.

    References
    ----------
    Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968), eq. 5.
    """
    n_boundary, n_interior = stiffness_boundary_interior.shape
    width = GROUP * int(np.clip(MEMORY / (8 * GROUP * n_interior), LEAST, MOST))
    place = np.empty((0, 0))
    for first in range(0, n_boundary, width):
        block = slice(first, min(first + width, n_boundary))
        forces = stiffness_boundary_interior[block].toarray().T
        if place.shape != forces.shape:
            place = np.empty(forces.shape, order="F")
        solution = factor.solve(forces, place)
        yield block, np.negative(solution, out=solution)
