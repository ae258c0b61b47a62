"""Integrals over faces of solid cells: area, area vector, volume inside a closed surface, nodal loads."""

from collections.abc import Callable
from functools import cache

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import Element
from fe.mesh import Mesh

Faces = Int[NDArray[np.int64], "k 2"]

#: Number of Gauss points per direction: exact to degree 9; area vectors of quadratic cells need degree 4.
N_POINT = 5


def integrate_areas(mesh: Mesh, faces: Faces) -> Float[NDArray[np.float64], " k"]:
    """Areas of faces [m^2]."""
    _, vectors = _sample_faces(mesh, faces)
    return np.asarray(np.linalg.norm(vectors, axis=2).sum(axis=1))


def integrate_volume(mesh: Mesh) -> float:
    r"""Volume inside the outer faces, V = 1/3 \oint x \cdot n dA, exact also for curved cells [m^3]."""
    points, vectors = _sample_faces(mesh, find_outer_faces(mesh))
    return float((points * vectors).sum() / 3)


def integrate_over_faces(
    mesh: Mesh,
    faces: Faces,
    density: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
) -> Float[NDArray[np.float64], "node n"]:
    r"""Nodal values of densities on faces, \int N_i p dA, shape (n_node, n).

    Parameters
    ----------
    mesh, faces
        The mesh, and cell and local face of each face, shape (k, 2) [-].
    density
        Function that returns the densities p, shape (..., n), at points with unit outward normals, shapes (..., 3).
    """
    points, vectors = _sample_faces(mesh, faces)
    area = np.linalg.norm(vectors, axis=2, keepdims=True)
    values = density(points, vectors / area) * area
    result = np.zeros((mesh.n_node, values.shape[2]))
    for here, element, local, nodes in mesh.face_groups(faces):
        shape = element.shape(_rule(element, local)[0])
        np.add.at(result, nodes, np.einsum("qa,eqn->ean", shape, values[here]))
    return result


def find_outer_faces(mesh: Mesh) -> Faces:
    """Faces that belong to only one cell: cell and local face, in the order of the cells."""
    keys, owners = [], []
    for start, element, cells in mesh.blocks():
        for local, corners in enumerate(element.corner_faces):
            key = np.full((len(cells), 4), -1)
            key[:, : len(corners)] = np.sort(cells[:, corners], axis=1)
            keys.append(key)
            owners.append(np.column_stack([start + np.arange(len(cells)), np.full(len(cells), local)]))
    owner = np.concatenate(owners)
    # Rows as single values of 32 bytes, which sort much faster than rows of numbers.
    rows = np.concatenate(keys).view("V32").ravel()
    _, which, count = np.unique(rows, return_inverse=True, return_counts=True)
    outer = owner[count[which] == 1]
    return np.asarray(outer[np.lexsort((outer[:, 1], outer[:, 0]))])


def _sample_faces(
    mesh: Mesh, faces: Faces
) -> tuple[Float[NDArray[np.float64], "k point 3"], Float[NDArray[np.float64], "k point 3"]]:
    """Gauss points on the faces, and weighted outward normals there."""
    n = N_POINT**2
    points, vectors = np.zeros((len(faces), n, 3)), np.zeros((len(faces), n, 3))
    for here, element, local, cells in mesh.face_groups(faces):
        nodes = mesh.points[cells]
        at, along, weights = _rule(element, local)
        points[here] = np.einsum("qa,eai->eqi", element.shape(at), nodes)
        slope = np.einsum("qaj,tj->tqa", element.gradient(at), along)
        u, v = (np.einsum("qa,eai->eqi", part, nodes) for part in slope)
        vectors[here] = np.cross(u, v) * weights[:, None]
    return points, vectors


@cache
def _rule(
    element: Element, local: int
) -> tuple[
    Float[NDArray[np.float64], "point 3"], Float[NDArray[np.float64], "2 3"], Float[NDArray[np.float64], " point"]
]:
    """Gauss points of a face in the cell's reference coordinates, its two directions, and weights."""
    x, w = np.polynomial.legendre.leggauss(N_POINT)
    s, t = (grid.ravel() for grid in np.meshgrid((1 + x) / 2, (1 + x) / 2))
    weights = np.outer(w, w).ravel() / 4
    origin, along = find_face_frame(element, local)
    if len(element.corner_faces[local]) == 3:
        # The square is mapped to a triangle: its side t = 1 becomes the third corner.
        s, weights = s * (1 - t), weights * (1 - t)
    return origin + np.column_stack([s, t]) @ along, along, weights


def find_face_frame(
    element: Element, local: int
) -> tuple[Float[NDArray[np.float64], " 3"], Float[NDArray[np.float64], "2 3"]]:
    """First corner of a face in reference coordinates, and two sides from it whose cross product points outwards."""
    corners = element.nodes[list(element.corner_faces[local])]
    return corners[0], np.stack([corners[1] - corners[0], corners[-1] - corners[0]])
