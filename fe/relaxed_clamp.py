"""The relaxed clamp: some of a face's nodes are left free, by one rule for every mesh."""

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from fe.errors import SupportError
from fe.mesh import Mesh

#: Coordinates are sorted as multiples of this, so that round-off cannot change the order [m].
SORTING = 1e-9


def thin_nodes(mesh: Mesh, nodes: Int[NDArray[np.int64], " k"], drop_every: int) -> Int[NDArray[np.int64], " m"]:
    """The vertex nodes among the given ones, with every `drop_every`-th left out.

    Midside nodes are never among them. The nodes are counted in the order of x, then y, then z, so the choice is
    uniform over the face and depends on the mesh alone.

    Parameters
    ----------
    mesh
        The mesh.
    nodes
        Of the clamped face, shape (k,) [-].
    drop_every
        2 leaves out every other node, 5 every fifth [-].

    Raises
    ------
    SupportError
        `drop_every` is below 2: nothing, or everything, would be left.

    References
    ----------
    Ferhatoglu, Botto and Zucca (2024), section 4: "relaxed configuration", a uniform subset of the clamping nodes.
    """
    if drop_every < 2:
        raise SupportError(f"drop_every = {drop_every}: give 2 or more, 5 leaves every fifth vertex node free")
    vertices = np.intersect1d(nodes, mesh.corner_nodes())
    x, y, z = np.round(mesh.points[vertices] / SORTING).T
    order = np.lexsort((z, y, x))
    kept = np.ones(len(vertices), dtype=bool)
    kept[order[drop_every - 1 :: drop_every]] = False
    return vertices[kept]
