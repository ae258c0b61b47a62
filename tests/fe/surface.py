"""The surface of a mesh, found from its cells alone: faces that belong to one cell, and their areas."""

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from fe.element import ELEMENTS
from fe.mesh import Mesh


def boundary(of: Mesh) -> NDArray[np.int64]:
    """Faces (cell, local face) that belong to one cell alone."""
    ((cell_type, cells),) = of.cells.items()
    element = ELEMENTS[cell_type]
    corner_faces = np.array([[node for node in face if node < element.n_corner] for face in element.faces])
    faces = np.sort(cells[:, corner_faces].reshape(-1, corner_faces.shape[1]), axis=1)
    _, place, times = np.unique(faces, axis=0, return_inverse=True, return_counts=True)
    assert times.max() == 2, "more than two cells share a face"
    return np.stack(np.divmod(np.flatnonzero(times[place.ravel()] == 1), len(corner_faces)), axis=1)


def area_vectors(of: Mesh, faces: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Outward area vectors (k, 3) and areas (k,) by Gauss points on the faces."""
    ((cell_type, cells),) = of.cells.items()
    element = ELEMENTS[cell_type]
    x, w = np.polynomial.legendre.leggauss(5)
    s, t = (grid.ravel() for grid in np.meshgrid(x, x))
    weights = np.outer(w, w).ravel()
    is_triangle = element.n_corner == 4
    if is_triangle:
        # The square folded into a triangle: its side t = 1 becomes the third corner.
        s, t, weights = (1 + s) * (1 - t) / 4, (1 + t) / 2, weights * (1 - t) / 8
    vectors, areas = np.zeros((len(faces), 3)), np.zeros(len(faces))
    for local, nodes in enumerate(element.faces):
        here = faces[:, 1] == local
        a, b, c, d = element.nodes[list(nodes[:4])]
        if is_triangle:
            origin, tangent = a, np.stack([b - a, c - a])
        else:
            origin, tangent = (a + b + c + d) / 4, np.stack([(b + c - a - d) / 4, (c + d - a - b) / 4])
        at = origin + np.outer(s, tangent[0]) + np.outer(t, tangent[1])
        slope = np.einsum("qaj,tj->qat", element.gradient(at), tangent)
        along = np.einsum("eai,qat->eqti", of.points[cells[faces[here, 0]]], slope)
        normal = np.cross(along[:, :, 0], along[:, :, 1])
        vectors[here] = np.einsum("eqi,q->ei", normal, weights)
        areas[here] = np.linalg.norm(normal, axis=2) @ weights
    return vectors, areas


def check_closed(cells: Mesh) -> None:
    """Every edge of the surface is run through once in each direction, and the surface looks nowhere in sum."""
    faces = boundary(cells)
    vectors, areas = area_vectors(cells, faces)
    np.testing.assert_allclose(vectors.sum(axis=0), 0, atol=1e-14 * areas.sum())
    ((cell_type, nodes),) = cells.cells.items()
    edges: Counter[tuple[int, int]] = Counter()
    for cell, local in faces:
        element = ELEMENTS[cell_type]
        corners = nodes[cell][[node for node in element.faces[local] if node < element.n_corner]]
        n = len(corners)
        edges.update((int(corners[k]), int(corners[(k + 1) % n])) for k in range(n))
    assert all(edges[b, a] == times for (a, b), times in edges.items())
