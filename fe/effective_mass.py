"""Effective modal masses: how much of the body moves with each mode when its supports shake."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.modal import ModeSet
from fe.system import LinearSystem


def compute_effective_masses(system: LinearSystem, modes: ModeSet) -> Float[NDArray[np.float64], "m 3"]:
    r"""Effective mass of each mode for a uniform support motion along x, y and z.

    .. math:: m_{k,d} = (\phi_k^T M r_d)^2, \qquad \phi_k^T M \phi_k = 1

    with r_d one on every free degree of freedom of direction d. Over all modes they sum to r_d^T M r_d, the mass that
    moves with the free degrees of freedom.

    Parameters
    ----------
    system
        The supported system.
    modes
        Its modes.

    Returns
    -------
    Shape (m, 3) [kg].

    References
    ----------
    Clough and Penzien, Dynamics of Structures, 2nd ed., section 26-2.
    """
    direction = system.free % 3
    uniform = (direction[:, None] == np.arange(3)).astype(np.float64)
    participation = modes.mode_shapes.T @ (system.mass @ uniform)
    return np.asarray(participation**2)
