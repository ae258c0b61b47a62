"""Check that modes are the lowest and complete: residuals, and a count of eigenvalues independent of Lanczos."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

from fe.sparse.solver import Backend, Definiteness, UnknownInertia, factorise

#: Smallest relative difference of two distinct eigenvalues [-]: far above their error of about 1e-9, and far below the
#: distance of modes that are not repeated.
GAP = 1e-5
#: Positions in a gap at which eigenvalues are counted; the next is used if the count is uncertain.
PLACES = (0.5, 0.3, 0.7, 0.1, 0.9)


@dataclass(frozen=True, kw_only=True, eq=False)
class ModeCheck:
    r"""Result of a check of modes.

    Parameters
    ----------
    residual
        Residual of each mode in the energy norm,
        :math:`\|K x - \lambda M x\|_{K^{-1}} / \|x\|_K`, shape (m,) [-]: a bound on the relative distance from
        lambda to the nearest eigenvalue, and to first order the relative error of the shape's energy outside its
        eigenspace.
    shift
        Value below which eigenvalues were counted [rad^2/s^2].
    n_below
        Number of eigenvalues below the shift [-].
    n_found
        Number of the given modes below the shift [-].
    """

    residual: Float[NDArray[np.float64], " m"]
    shift: float
    n_below: int
    n_found: int

    @cached_property
    def n_missed(self) -> int:
        """Number of modes below the shift that were not found [-]; negative if a mode was found twice."""
        return self.n_below - self.n_found


def check_modes(
    stiffness: sp.csr_array,
    mass: sp.csr_array,
    lambda_: Float[NDArray[np.float64], " m"],
    shapes: Float[NDArray[np.float64], "n m"],
    backend: Backend | str | None = None,
) -> ModeCheck:
    """Compute residuals of the lowest modes, and a Sturm count in the highest gap between them.

    Parameters
    ----------
    stiffness, mass
        Positive definite matrices, shape (n, n) [N/m, kg].
    lambda_, shapes
        Eigenvalues, ascending and positive [rad^2/s^2], and their shapes (n, m).
    backend
        Library for the factorisations of K and of K - shift M.

    Raises
    ------
    UnknownInertia
        No shift in the gap could be factorised with pivots whose signs are known.

    References
    ----------
    Parlett, The Symmetric Eigenvalue Problem (1998), section 3.3: counting by Sylvester's inertia theorem.
    """
    inertia = mass @ shapes
    # The matrices are used, because the round-off of a factor would appear as an error of the modes.
    rest = stiffness @ shapes - lambda_ * inertia
    energy = np.einsum("nm,nm->m", rest, factorise(stiffness, backend=backend).solve(rest))
    length = lambda_ * np.einsum("nm,nm->m", shapes, inertia)
    low, high, n_found = _find_highest_gap(lambda_)
    shift, n_below = count_below(stiffness, mass, low, high, backend)
    return ModeCheck(residual=np.sqrt(np.abs(energy) / length), shift=shift, n_below=n_below, n_found=n_found)


def count_below(
    stiffness: sp.csr_array, mass: sp.csr_array, low: float, high: float, backend: Backend | str | None = None
) -> tuple[float, int]:
    """Choose a shift between two bounds, and count the eigenvalues of K x = lambda M x below it.

    K - shift M has as many negative pivots as there are eigenvalues below the shift. The count does not depend on the
    eigensolver that is checked.

    Raises
    ------
    UnknownInertia
        As in `check_modes`.
    """
    for place in PLACES:
        shift = low + place * (high - low)
        try:
            return shift, factorise(sp.csr_array(stiffness - shift * mass), Definiteness.INDEFINITE, backend).n_negative
        except UnknownInertia as error:
            reason = error
    raise reason


def _find_highest_gap(lambda_: Float[NDArray[np.float64], " m"]) -> tuple[float, float, int]:
    """Bounds of the highest gap, and number of modes below it; the gap below all modes if these are all equal."""
    gaps = np.flatnonzero(np.diff(lambda_) > GAP * lambda_[1:])
    if not len(gaps):
        return (1 - 3 * GAP) * float(lambda_[0]), (1 - GAP) * float(lambda_[0]), 0
    last = int(gaps[-1])
    return float(lambda_[last]), float(lambda_[last + 1]), last + 1
