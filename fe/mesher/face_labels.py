"""CAD face of each triangle on the boundary of a mesh."""

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from geometry.solid_skin import Facets

Points = Float[NDArray[np.float64], "k 3"]
Triangles = Int[NDArray[np.int64], "k 3"]

#: Barycentric coordinates of the points in a triangle whose scores are averaged: the middle, and towards each corner.
VOTERS = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / np.array([[3], [6], [6], [6]])
#: Distance that is added for a normal perpendicular to the face's, relative to the triangle's size.
NORMAL_PENALTY = 0.3
#: Number of pairs of a point and a facet per batch; intermediate arrays then need 300 MB.
PAIRS = 1_000_000


def label_faces(points: Points, triangles: Triangles, facets: Facets) -> Int[NDArray[np.int64], " k"]:
    """Face whose facets are nearest to each triangle and have nearly its normal.

    Parameters
    ----------
    points, triangles
        Boundary of the mesh, anticlockwise from outside [m].
    facets
        Facets of the CAD solid.
    """
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double_area = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.maximum(double_area, np.finfo(float).tiny)
    size = np.sqrt(double_area[:, 0])
    voters = np.einsum("vc,kci->kvi", VOTERS, corners)
    n_face = int(facets.face.max()) + 1
    score = np.full((len(triangles), n_face), np.inf)
    for face in range(n_face):
        cad = facets.points[facets.triangles[facets.face == face]]
        # A triangle of the face is at most its own size away from the box around the face.
        low, high = cad.min(axis=(0, 1)), cad.max(axis=(0, 1))
        outside = np.maximum(low - voters[:, 0], voters[:, 0] - high).max(axis=1)
        near = np.flatnonzero(outside < size)
        if near.size:
            distance, facet = _find_nearest(voters[near].reshape(-1, 3), cad)
            facing = np.cross(cad[:, 1] - cad[:, 0], cad[:, 2] - cad[:, 0])
            facing /= np.linalg.norm(facing, axis=1, keepdims=True)
            turned = 1 - np.einsum("kvi,ki->kv", facing[facet.reshape(-1, len(VOTERS))], normal[near])
            penalty = NORMAL_PENALTY * size[near, None] * turned
            score[near, face] = (distance.reshape(turned.shape) + penalty).mean(axis=1)
    return _without_islands(triangles, score.argmin(axis=1))


def _find_nearest(
    points: Points, triangles: Float[NDArray[np.float64], "t 3 3"]
) -> tuple[Float[NDArray[np.float64], " k"], Int[NDArray[np.int64], " k"]]:
    """Distance of each point to the nearest triangle, and number of this triangle."""
    middle = triangles.mean(axis=1)
    reach = float(np.linalg.norm(triangles - middle[:, None], axis=2).max())
    # A triangle nearer than the nearest corner has its middle within that distance plus the size of the triangle.
    bound = cKDTree(triangles.reshape(-1, 3)).query(points)[0] + reach * (1 + 1e-9)
    near = [np.asarray(item, dtype=np.int64) for item in cKDTree(middle).query_ball_point(points, bound)]
    distance, which = np.empty(len(points)), np.empty(len(points), dtype=np.int64)
    ends = np.cumsum([len(item) for item in near])
    first = 0
    while first < len(points):
        before = ends[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(ends, before + PAIRS, side="right")))
        count = np.diff(ends[first:last], prepend=before)
        facet = np.concatenate(near[first:last])
        apart = _compute_distances(np.repeat(points[first:last], count, axis=0), triangles[facet])
        start = np.cumsum(count) - count
        distance[first:last] = np.minimum.reduceat(apart, start)
        hits = np.flatnonzero(apart == np.repeat(distance[first:last], count))
        which[first:last] = facet[hits[np.searchsorted(hits, start)]]
        first = last
    return distance, which


def _compute_distances(
    points: Points, triangles: Float[NDArray[np.float64], "k 3 3"]
) -> Float[NDArray[np.float64], " k"]:
    """Distance of each point to its triangle: to the plane if the point is above it, else to the nearest side."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inside = np.ones(len(points), dtype=bool)
    to_side = np.full(len(points), np.inf)
    for k in range(3):
        start, side = triangles[:, k], triangles[:, (k + 1) % 3] - triangles[:, k]
        from_start = points - start
        along = np.clip((from_start * side).sum(axis=1) / (side**2).sum(axis=1), 0, 1)
        to_side = np.minimum(to_side, np.linalg.norm(from_start - along[:, None] * side, axis=1))
        inside &= (from_start * np.cross(normal, side)).sum(axis=1) >= 0
    to_plane = np.abs(((points - triangles[:, 0]) * normal).sum(axis=1))
    return np.where(inside, to_plane, to_side)


def _without_islands(triangles: Triangles, label: Int[NDArray[np.int64], " k"]) -> Int[NDArray[np.int64], " k"]:
    """Labels in which a triangle without neighbours of its own label gets the label of two of its neighbours."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, which = np.unique(sides, axis=0, return_inverse=True)
    order = np.argsort(which.ravel(), kind="stable").reshape(-1, 2) // 3
    neighbour = np.empty((len(triangles), 3), dtype=np.int64)
    place = np.argsort(which.ravel(), kind="stable").reshape(-1, 2)
    neighbour.reshape(-1)[place[:, 0]] = order[:, 1]
    neighbour.reshape(-1)[place[:, 1]] = order[:, 0]
    around = np.sort(label[neighbour], axis=1)
    lonely = (around != label[:, None]).all(axis=1) & ((around[:, 0] == around[:, 1]) | (around[:, 1] == around[:, 2]))
    return np.where(lonely, around[:, 1], label)
