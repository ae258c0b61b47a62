"""Move nodes on the boundary of a mesh onto the faces, edges and corners of the CAD solid."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import TET10
from fe.mesh import Mesh
from fe.mesh_quality import measure_cell_quality
from geometry.solid_skin import SolidSkin

Points = Float[NDArray[np.float64], "k 3"]
#: Numbers of the CAD faces on which each node or edge on the boundary lies.
Labels = Mapping[int, frozenset[int]]

#: Smallest flatness of a cell after corner nodes are moved, and smallest determinant ratio after midside nodes are
#: moved; nodes of cells below are moved back.
FLAT, FOLDED = 0.01, 0.15
#: Number of rounds of moving nodes back, and of the first rounds, which move them half way.
ROUNDS, HALVINGS = 20, 4


def snap_corners(
    points: Points, cells: Int[NDArray[np.int64], "cell 4"], labels: Labels, skin: SolidSkin, limit: float
) -> Points:
    """Corner nodes moved onto their faces, edges and corners, except where a cell would become flat or inverted.

    Parameters
    ----------
    points, cells
        The raw mesh [m].
    labels
        Faces of each corner node on the boundary.
    skin
        The CAD solid.
    limit
        Largest distance by which a node may be moved [m].
    """
    target = _project_points(points, labels, skin, np.full(len(points), limit))
    result = target.copy()
    for round_ in range(ROUNDS):
        edges = result[cells[:, 1:]] - result[cells[:, :1]]
        bad = np.flatnonzero(_compute_flatness(edges) < FLAT)
        nodes = np.unique(cells[bad])
        nodes = nodes[(result[nodes] != points[nodes]).any(axis=1)]
        if not nodes.size:
            break
        result[nodes] = (result[nodes] + points[nodes]) / 2 if round_ < HALVINGS else points[nodes]
    return result


def add_midside_nodes(points: Points, cells: Int[NDArray[np.int64], "cell 4"], labels: Labels, skin: SolidSkin) -> Mesh:
    """Tetrahedra of ten nodes whose midside nodes on the boundary are on the CAD solid, except where a cell would fold.

    Parameters
    ----------
    points, cells
        Corners [m].
    labels
        Faces of each edge on the boundary, by its index among the sorted edges of `sort_edges`.
    skin
        The CAD solid.
    """
    edges, which = sort_edges(cells)
    straight = (points[edges[:, 0]] + points[edges[:, 1]]) / 2
    length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    middles = _project_points(straight, labels, skin, 0.3 * length)
    quadratic = np.column_stack([cells, len(points) + which])
    while True:
        mesh = Mesh(points=np.vstack([points, middles]), cells={TET10.cell_type: quadratic})
        bad = np.flatnonzero(measure_cell_quality(mesh).determinant_ratio < FOLDED)
        back = np.unique(which[bad])
        back = back[(middles[back] != straight[back]).any(axis=1)]
        if not back.size:
            return mesh
        middles[back] = straight[back]


def sort_edges(
    cells: Int[NDArray[np.int64], "cell 4"],
) -> tuple[Int[NDArray[np.int64], "edge 2"], Int[NDArray[np.int64], "cell 6"]]:
    """Edges as two nodes in ascending order, and the six edges of each cell in the order of its midside nodes."""
    pairs = np.sort(cells[:, [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]], axis=2)
    edges, which = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    return edges, which.reshape(-1, 6)


def _project_points(points: Points, labels: Labels, skin: SolidSkin, limit: Float[NDArray[np.float64], " k"]) -> Points:
    """Points projected onto their face, edge or corner; points farther away than their limit are not moved."""
    result = points.copy()
    nearest = np.full(len(points), np.inf)
    groups = {node: frozenset(int(skin.group[face]) for face in faces) for node, faces in labels.items()}
    by_face: dict[int, list[int]] = {}
    for node, faces in labels.items():
        if len(groups[node]) == 1:
            for face in faces:
                by_face.setdefault(face, []).append(node)
    for face, members in by_face.items():
        nodes = np.array(members)
        on_face = skin.to_face(face, points[nodes])
        way = np.linalg.norm(on_face - points[nodes], axis=1)
        better = way < np.minimum(nearest[nodes], limit[nodes])
        result[nodes[better]] = on_face[better]
        nearest[nodes[better]] = way[better]
    for node, meeting in groups.items():
        if len(meeting) == 1:
            continue
        place = skin.to_corner(meeting, points[node]) if len(meeting) > 2 else None
        if place is None or np.linalg.norm(place - points[node]) > limit[node]:
            place = skin.to_edge(meeting, points[node])
        if place is not None and np.linalg.norm(place - points[node]) <= limit[node]:
            result[node] = place
    return result


def _compute_flatness(edges: Float[NDArray[np.float64], "cell 3 3"]) -> Float[NDArray[np.float64], " cell"]:
    """Six times the volume over the cubed r.m.s. edge length at a corner: sqrt(1/2) if regular, 0 if flat."""
    length = np.sqrt((edges**2).sum(axis=2).mean(axis=1))
    return np.asarray(np.linalg.det(edges) / length**3)
