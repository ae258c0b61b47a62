"""The outer faces of a mesh, each sampled finely enough that quadratic ones are drawn curved.

Everything is a sparse matrix over nodes, so that one skin serves the body at rest, deformed and at every frame.
"""

from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import Element
from fe.face_integral import find_face_frame, find_outer_faces
from fe.mesh import Mesh

#: Corners of a triangle in the two directions of a face.
TRIANGLE = np.array([[0, 0], [1, 0], [0, 1]], dtype=float)
Weights = Float[NDArray[np.float64], "point node_of_face"]
Samples: TypeAlias = tuple[
    Float[NDArray[np.float64], "point 2"], Int[NDArray[np.int64], "facet 4"], Int[NDArray[np.int64], "side along"]
]
#: Facets along the side of a quadratic face: enough that a quarter circle of two elements looks round.
FACETS = 4
#: An edge between two outer faces whose normals differ by more than this is an edge of the body [degrees].
FEATURE_ANGLE = 25.0


@dataclass(frozen=True, kw_only=True, eq=False)
class FacePattern:
    """The samples of one face.

    Parameters
    ----------
    value, along_u, along_v
        Shape functions and their two derivatives at the samples, shape (n_point, n_node_of_face) [-]; the cross
        product of the derivatives points out of the cell.
    facets
        Samples of each facet, anticlockwise, shape (n_facet, 4) [-].
    rims
        Samples along each side, from corner to corner, shape (n_side, n_along + 1) [-].
    """

    value: Weights
    along_u: Weights
    along_v: Weights
    facets: Int[NDArray[np.int64], "facet 4"]
    rims: Int[NDArray[np.int64], "side along"]


@cache
def make_face_pattern(element: Element, local: int, n: int) -> FacePattern:
    """The pattern of a face with `n` facets along its sides, an even number for triangles."""
    face = list(element.faces[local])
    at, facets, rims = (_sample_triangle if len(element.corner_faces[local]) == 3 else _square)(n)
    origin, along = find_face_frame(element, local)
    value = element.shape(origin + at @ along)[:, face]
    u, v = np.einsum("qaj,tj->tqa", element.gradient(origin + at @ along)[:, face], along)
    return FacePattern(value=value, along_u=u, along_v=v, facets=facets, rims=rims)


def _square(n: int) -> Samples:
    """Places of the samples in the two directions of the face, facets and rims."""
    local = np.linspace(0, 1, n + 1)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    rims = np.stack([index[0], index[:, -1], index[-1, ::-1], index[::-1, 0]])
    return np.array([(u, v) for v in local for u in local]), _list_facets(index), rims


def _sample_triangle(n: int) -> Samples:
    """Three quadrilaterals, each between a corner, the middles of the two sides there and the centre."""
    half = n // 2
    a, b = (grid.ravel()[:, None] for grid in np.meshgrid(*[np.linspace(0, 1, half + 1)] * 2))
    centre = TRIANGLE.mean(axis=0)
    points, facets, index = [], [], []
    for k, corner in enumerate(TRIANGLE):
        after, before = ((corner + TRIANGLE[(k + step) % 3]) / 2 for step in (1, 2))
        points.append((1 - a) * (1 - b) * corner + a * (1 - b) * after + a * b * centre + (1 - a) * b * before)
        index.append((half + 1) ** 2 * k + np.arange((half + 1) ** 2).reshape(half + 1, half + 1))
        facets.append(_list_facets(index[-1]))
    rims = [np.concatenate([index[k][0], index[(k + 1) % 3][-2::-1, 0]]) for k in range(3)]
    return np.concatenate(points), np.concatenate(facets), np.stack(rims)


def _list_facets(index: Int[NDArray[np.int64], "v u"]) -> Int[NDArray[np.int64], "facet 4"]:
    return np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)


@dataclass(frozen=True, kw_only=True, eq=False)
class Skin:
    """Visible surface of a mesh.

    Parameters
    ----------
    sample
        Values at the skin's points from values at the nodes, sparse, shape (n_point, n_node) [-].
    along_u, along_v
        Derivatives along the two directions of each face: their cross product points outwards, same shape [-].
    quads
        Points of each facet, shape (n_facet, 4) [-].
    edges
        Points of each element edge as a polyline, shape (n_edge, n_point_of_edge) [-].
    is_feature
        Whether the edge is an edge of the body at rest, shape (n_edge,) [-].
    """

    sample: sp.csr_array
    along_u: sp.csr_array
    along_v: sp.csr_array
    quads: Int[NDArray[np.int64], "facet 4"]
    edges: Int[NDArray[np.int64], "edge point"]
    is_feature: NDArray[np.bool_]

    def normals(self, nodes: Float[NDArray[np.float64], "node 3"]) -> Float[NDArray[np.float64], "point 3"]:
        """Outward unit normals at the skin's points for the given positions of the nodes."""
        normal = np.cross(self.along_u @ nodes, self.along_v @ nodes)
        return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny))


def make_skin(mesh: Mesh) -> Skin:
    """Find the faces that belong to one cell only, and sample them."""
    faces = find_patterned_faces(mesh)
    samples: list[sp.csr_array] = []
    along_u: list[sp.csr_array] = []
    along_v: list[sp.csr_array] = []
    quads, edges, sides = [], [], []
    n_point = 0
    for pattern, nodes in faces:
        for weights, gathered in (
            (pattern.value, samples),
            (pattern.along_u, along_u),
            (pattern.along_v, along_v),
        ):
            gathered.append(_spread(weights, nodes, mesh.n_node))
        start = n_point + len(pattern.value) * np.arange(len(nodes))[:, None, None]
        quads.append((pattern.facets + start).reshape(-1, 4))
        edges.append((pattern.rims + start).reshape(-1, pattern.rims.shape[1]))
        corners = nodes[:, : len(pattern.rims)]
        sides.append(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2))
        n_point += len(pattern.value) * len(nodes)
    sample, u, v = (sp.csr_array(sp.vstack(parts)) for parts in (samples, along_u, along_v))
    every = Skin(
        sample=sample,
        along_u=u,
        along_v=v,
        quads=np.concatenate(quads),
        edges=np.concatenate(edges),
        is_feature=np.empty(0, dtype=bool),
    )
    single, is_feature = _find_single_edges(every, np.concatenate(sides), every.normals(mesh.points))
    return Skin(
        sample=sample, along_u=u, along_v=v, quads=every.quads, edges=every.edges[single], is_feature=is_feature
    )


def find_patterned_faces(mesh: Mesh) -> list[tuple[FacePattern, Int[NDArray[np.int64], "face node"]]]:
    """Nodes of the outer faces, corners first and anticlockwise from outside, with the pattern of each kind of face."""
    groups: dict[tuple[Element, int], list[tuple[int, NDArray[np.int64]]]] = {}
    for _, element, local, cells in mesh.face_groups(find_outer_faces(mesh)):
        nodes = cells[:, element.faces[local]]
        if len(nodes):
            groups.setdefault((element, nodes.shape[1]), []).append((local, nodes))
    # One number of facets for all, so that all edges have one number of points; a linear quadrilateral needs no more.
    n = 1 if all(n_node == 4 for _, n_node in groups) else FACETS
    return [
        (make_face_pattern(element, group[0][0], n), np.concatenate([nodes for _, nodes in group]))
        for (element, _), group in groups.items()
    ]


def _find_single_edges(
    skin: Skin, sides: Int[NDArray[np.int64], "side 2"], normals: Float[NDArray[np.float64], "point 3"]
) -> tuple[Int[NDArray[np.int64], " edge"], NDArray[np.bool_]]:
    """One of the two polylines of each edge, and whether the faces beside it meet at an angle."""
    ordered = np.sort(sides, axis=1)
    _, first, which = np.unique(ordered, axis=0, return_index=True, return_inverse=True)
    which = which.ravel()
    middle = skin.edges[:, skin.edges.shape[1] // 2]
    total = np.zeros((len(first), 3))
    np.add.at(total, which, normals[middle])
    count = np.bincount(which)
    # The mean of unit normals that differ by an angle a has the length cos(a / 2); a lone side is a rim.
    flatness = np.linalg.norm(total, axis=1) / count
    return first, (count == 1) | (flatness < np.cos(np.deg2rad(FEATURE_ANGLE) / 2))


def _spread(
    weights: Float[NDArray[np.float64], "point node_of_face"], nodes: Int[NDArray[np.int64], "face node"], n_node: int
) -> sp.csr_array:
    """The same weights on every face, as rows over all nodes."""
    n_face, per_face = nodes.shape
    n_point = len(weights)
    columns = np.repeat(nodes, n_point, axis=0).ravel()
    values = np.tile(weights, (n_face, 1)).ravel()
    starts = per_face * np.arange(n_face * n_point + 1)
    return sp.csr_array((values, columns, starts), shape=(n_face * n_point, n_node))
