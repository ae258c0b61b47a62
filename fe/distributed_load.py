r"""Distribute a force at any point over a patch of nodes without stiffening the patch.

With the mean position c of the nodes and their positions r_i relative to it,

.. math:: f_i = \frac{1}{n} (F + b \times r_i), \qquad
          \frac{1}{n} \sum_i r_i \times (b \times r_i) = (p - c) \times F ,

the nodal forces have the resultant F and the moment of F at p, and are the smallest with this property. All nodes have
equal weight, so that the traction follows the density of the mesh. The point p need not lie on the body; a dead weight
may act beside it.
"""

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.mesh import Mesh

#: Smallest ratio of the widths of a patch that can transmit a moment about every axis.
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
        Mesh of the body.
    nodes
        Nodes of the patch, at least three, shape (k,) [-].
    force
        Force F, shape (3,) [N].
    point
        Point p at which the force acts, shape (3,) [m].

    Raises
    ------
    MeshError
        Nodes on a straight line, which cannot transmit a moment about it.
    """
    nodes = np.unique(nodes)
    places = mesh.points[nodes]
    middle = places.mean(axis=0) if len(nodes) else np.zeros(3)
    about = places - middle
    # The mean is not exactly zero because of round-off, which matters for a distant point.
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
