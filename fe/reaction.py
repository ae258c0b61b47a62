r"""What supports push back with.

With the free displacements q and the fixed ones at rest, the forces of the supports on the body are

.. math:: R = K_{sf} q + M_{sf} \ddot q ,

and those of one set of nodes, summed for each direction, are three rows over the free displacements.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.sparse.factor import Symmetric

Rows = Float[NDArray[np.float64], "3 n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class SupportReaction:
    """Force of the supports of one set of nodes on a body, along x, y and z.

    Parameters
    ----------
    stiffness, mass
        Rows over displacements and over accelerations, shape (3, n) [N/m, kg].
    """

    stiffness: Rows
    mass: Rows


def find_reaction(
    stiffness: Symmetric,
    mass: Symmetric,
    nodes: Int[NDArray[np.int64], " k"],
    free: Int[NDArray[np.int64], " n"],
) -> SupportReaction:
    """Rows of the reaction of a set of fixed nodes.

    Parameters
    ----------
    stiffness, mass
        Of the whole mesh, before supports, shape (3 n_node, 3 n_node) [N/m, kg].
    nodes
        Fixed in all directions.
    free
        Free degrees of freedom of the mesh, which the rows are over.
    """
    picked = np.zeros((3, stiffness.shape[0]))
    for direction in range(3):
        picked[direction, 3 * nodes + direction] = 1.0
    # The matrices are symmetric: rows of the fixed are columns of them.
    return SupportReaction(stiffness=(stiffness @ picked.T)[free].T, mass=(mass @ picked.T)[free].T)
