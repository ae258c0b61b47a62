"""Fixed-interface modes: how the interior vibrates while the boundary is fixed."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.errors import SupportError
from fe.modal import lowest_eigenpairs
from fe.sparse.factor import Symmetric
from fe.sparse.solver import Factor
from reduction.errors import RomError


def fixed_interface_modes(
    mass: Symmetric, stiffness: Symmetric, n_mode: int, factor: Factor
) -> tuple[Float[NDArray[np.float64], " m"], Float[NDArray[np.float64], "i m"]]:
    r"""Lowest eigenpairs of the interior, :math:`K_{ii} \phi = \omega^2 M_{ii} \phi`.

    Parameters
    ----------
    mass, stiffness
        Of the interior, shape (i, i) [kg, N/m].
    n_mode
        How many [-], at least 1 and at most i.
    factor
        Of the interior stiffness.

    Returns
    -------
    Eigenvalues, ascending, shape (m,) [rad^2/s^2], and mass-normalised shapes (i, m) [kg^-1/2].

    Raises
    ------
    RomError
        The interior can still move as a rigid body while the boundary is fixed.
    """
    try:
        return lowest_eigenpairs(stiffness, mass, n_mode, factor)
    except SupportError as error:
        raise RomError(loose_interior(stiffness.shape[0])) from error


def loose_interior(n_interior: int) -> str:
    """The sentence for an interior of n degrees of freedom that its boundary does not hold."""
    return (
        f"the {n_interior} interior degrees of freedom can still move as a rigid body while the boundary is fixed: "
        "add supports, or boundary degrees of freedom at three nodes that are not in line"
    )
