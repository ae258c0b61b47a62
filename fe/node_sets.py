"""Sets of nodes: named by where they are, or thinned out for a relaxed clamp."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fe.errors import MeshError, SupportError
from fe.mesh import Mesh


def add_named_points(mesh: Mesh, points: Mapping[str, Float[NDArray[np.float64], "3"]]) -> Mesh:
    """The mesh with a node set of one node for each point: the corner node nearest to it.

    Corner nodes alone are taken: the local compliance at a midside node differs by a factor of two. How far the node
    is from its point is at most half an element, and depends on the mesh.
    """
    corners = mesh.corner_nodes()
    tree = cKDTree(mesh.points[corners])
    nearest = np.atleast_1d(tree.query(np.stack(list(points.values())))[1])
    result = {name: corners[[place]] for name, place in zip(points, nearest, strict=True)}
    return replace(mesh, node_sets={**mesh.node_sets, **result})


#: A line that a mesh follows has a corner node no farther than this from each station [m].
ON_NODE = 1e-9


def add_stations(mesh: Mesh, stations: Mapping[str, Float[NDArray[np.float64], "_ 3"]]) -> Mesh:
    """The mesh with a node set for each list of stations, one corner node per station, in the order of the stations.

    Raises
    ------
    MeshError
        A station is farther than `ON_NODE` from every corner node: the mesh does not follow the line.
    """
    corners = mesh.corner_nodes()
    tree = cKDTree(mesh.points[corners])
    result = {}
    for name, places in stations.items():
        distance, nearest = (np.atleast_1d(part) for part in tree.query(places))
        if distance.max() > ON_NODE:
            worst = int(distance.argmax())
            raise MeshError(
                f'station {worst + 1} of "{name}" is {distance[worst] * 1e6:.3g} um from the nearest corner node: '
                "give the contact line a number of elements that is a multiple of the stations' intervals"
            )
        result[name] = corners[nearest]
    return replace(mesh, node_sets={**mesh.node_sets, **result})


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
        Nodes of the clamped face, shape (k,) [-].
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
