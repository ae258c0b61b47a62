"""Sets of nodes: nodes nearest to points or stations, and a part of the nodes of a clamp."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fe.errors import MeshError, SupportError
from fe.mesh import Mesh


def add_named_points(mesh: Mesh, points: Mapping[str, Float[NDArray[np.float64], "3"]]) -> Mesh:
    """Mesh with a node set of one node for each point: the corner node nearest to it.

    Only corner nodes are used, because the local compliance at a midside node differs by a factor of two. The distance
    of the node from its point is at most half an element, and depends on the mesh.
    """
    corners = mesh.corner_nodes()
    tree = cKDTree(mesh.points[corners])
    nearest = np.atleast_1d(tree.query(np.stack(list(points.values())))[1])
    result = {name: corners[[place]] for name, place in zip(points, nearest, strict=True)}
    return replace(mesh, node_sets={**mesh.node_sets, **result})


#: Largest distance of a station from its corner node [m].
ON_NODE = 1e-9


def add_stations(mesh: Mesh, stations: Mapping[str, Float[NDArray[np.float64], "_ 3"]]) -> Mesh:
    """Mesh with a node set for each list of stations, one corner node per station, in the order of the stations.

    Raises
    ------
    MeshError
        A station is farther than `ON_NODE` from every corner node.
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


#: Unit to which coordinates are rounded before sorting, so that round-off cannot change the order [m].
SORTING = 1e-9


def thin_nodes(mesh: Mesh, nodes: Int[NDArray[np.int64], " k"], drop_every: int) -> Int[NDArray[np.int64], " m"]:
    """Corner nodes among the given nodes, without every `drop_every`-th.

    Midside nodes are left out. The nodes are sorted by x, then y, then z, so the choice is uniform over the face and
    depends only on the mesh.

    Parameters
    ----------
    mesh
        The mesh.
    nodes
        Nodes of the clamped face, shape (k,) [-].
    drop_every
        Interval of nodes that are left out: 2 for every other node, 5 for every fifth [-].

    Raises
    ------
    SupportError
        `drop_every` is below 2.

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
