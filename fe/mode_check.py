"""Check that modes are the lowest ones, and all: residuals, and a count of eigenvalues independent of Lanczos."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

from fe.sparse.solver import Backend, Definiteness, UnknownInertia, factorise

#: Two eigenvalues are apart if they differ by more than this [-]: far above their error of about 1e-9, far below the
#: distance of modes that nothing makes alike.
GAP = 1e-5
#: Where in a gap eigenvalues are counted, one after the other if a count proves nothing.
PLACES = (0.5, 0.3, 0.7, 0.1, 0.9)


@dataclass(frozen=True, kw_only=True, eq=False)
class ModeCheck:
    r"""Result of a check of modes.

    Parameters
    ----------
    residual
        Residual of each mode in the energy norm,
        :math:`\|K x - \lambda M x\|_{K^{-1}} / \|x\|_K`, shape (m,) [-]: a bound on the relative distance from
        lambda to the nearest eigenvalue, and to first order the relative error of the shape's energy outside its own
        eigenspace.
    shift
        Below which eigenvalues were counted [rad^2/s^2].
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
        """Modes below the shift that were not found [-]; negative if one was found twice."""
        return self.n_below - self.n_found


def check_modes(
    stiffness: sp.csr_array,
    mass: sp.csr_array,
    lambda_: Float[NDArray[np.float64], " m"],
    shapes: Float[NDArray[np.float64], "n m"],
    backend: Backend | str | None = None,
) -> ModeCheck:
    """Residuals of the lowest modes, and a Sturm count in the highest gap between them.

    Parameters
    ----------
    stiffness, mass
        Positive definite, shape (n, n) [N/m, kg].
    lambda_, shapes
        Eigenvalues, ascending and positive [rad^2/s^2], and their shapes (n, m).
    backend
        For the factorisations of K and of K - shift M.

    Raises
    ------
    UnknownInertia
        No shift in the gap could be factorised with pivots whose signs are known.

    References
    ----------
    Parlett, The Symmetric Eigenvalue Problem (1998), section 3.3: counting by Sylvester's inertia theorem.
    """
    inertia = mass @ shapes
    # With the matrices themselves: what round-off has left in a factor would count as an error of the modes.
    rest = stiffness @ shapes - lambda_ * inertia
    energy = np.einsum("nm,nm->m", rest, factorise(stiffness, backend=backend).solve(rest))
    length = lambda_ * np.einsum("nm,nm->m", shapes, inertia)
    low, high, n_found = _find_highest_gap(lambda_)
    shift, n_below = count_below(stiffness, mass, low, high, backend)
    return ModeCheck(residual=np.sqrt(np.abs(energy) / length), shift=shift, n_below=n_below, n_found=n_found)


def count_below(
    stiffness: sp.csr_array, mass: sp.csr_array, low: float, high: float, backend: Backend | str | None = None
) -> tuple[float, int]:
    """A shift between two bounds, and the number of eigenvalues of K x = lambda M x below it.

    K - shift M has as many negative pivots as there are eigenvalues below the shift, whatever the solver that is to
    be checked may have missed.

    Raises
    ------
    UnknownInertia
        As `check_modes`.
    """
    for place in PLACES:
        shift = low + place * (high - low)
        try:
            return shift, factorise(sp.csr_array(stiffness - shift * mass), Definiteness.INDEFINITE, backend).n_negative
        except UnknownInertia as error:
            reason = error
    raise reason


def _find_highest_gap(lambda_: Float[NDArray[np.float64], " m"]) -> tuple[float, float, int]:
    """Bounds of the highest gap, and the modes below it; the gap below all modes if they are all alike."""
    gaps = np.flatnonzero(np.diff(lambda_) > GAP * lambda_[1:])
    if not len(gaps):
        return (1 - 3 * GAP) * float(lambda_[0]), (1 - GAP) * float(lambda_[0]), 0
    last = int(gaps[-1])
    return float(lambda_[last]), float(lambda_[last + 1]), last + 1
