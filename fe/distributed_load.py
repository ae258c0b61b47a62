r"""A force, wherever it acts, spread over a patch of nodes that carries it without being stiffened.

With the mean place c of the nodes, r_i their places about it,

.. math:: f_i = \frac{1}{n} (F + b \times r_i), \qquad
          \frac{1}{n} \sum_i r_i \times (b \times r_i) = (p - c) \times F ,

has the resultant F and the moment of F at p, and is the smallest such set of forces. All nodes count alike, so that
the traction follows the density of the mesh. The point p need not lie on the
body: a dead weight may pull beside it.
"""

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.mesh import Mesh

#: Smallest width of a patch over its largest that can take a moment about every axis.
SLENDER = 1e-3


def distribute_load(
    mesh: Mesh,
    nodes: Int[NDArray[np.int64], " k"],
    force: Float[NDArray[np.float64], " 3"],
    point: Float[NDArray[np.float64], " 3"],
) -> Float[NDArray[np.float64], "node 3"]:
    """Nodal forces of a resultant at a point, shape (n_node, 3) [N].

    Parameters
    ----------
    mesh
        The body.
    nodes
        The patch, three nodes at least.
    force
        F [N].
    point
        p, where it acts [m].

    Raises
    ------
    MeshError
        Nodes on one straight line, which take no moment about it.
    """
    nodes = np.unique(nodes)
    places = mesh.points[nodes]
    middle = places.mean(axis=0) if len(nodes) else np.zeros(3)
    about = places - middle
    # The mean of rounded places is not quite zero, and a far point has a long lever.
    about -= about.mean(axis=0) if len(nodes) else 0.0
    squares = about.T @ about / max(len(nodes), 1)
    widths = np.linalg.eigvalsh(squares)
    if len(nodes) < 3 or widths[1] <= SLENDER**2 * widths[2]:
        raise MeshError(
            f"the {len(nodes)} nodes of a distributed load lie on one straight line, which cannot carry a moment "
            "about itself: give a patch of a face"
        )
    inertia = np.trace(squares) * np.eye(3) - squares
    turn = np.linalg.solve(inertia, np.cross(np.asarray(point) - middle, force))
    nodal = np.zeros_like(mesh.points)
    nodal[nodes] = (np.asarray(force) + np.cross(turn, about)) / len(nodes)
    return nodal
