"""Points on the surface of a mesh that are not nodes: the face on which each lies, and the shape functions there."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fe.element import Element
from fe.errors import MeshError, PointOffSurface
from fe.face_integral import find_face_frame
from fe.mesh import Mesh

Faces = Int[NDArray[np.int64], "k 2"]
Places = Float[NDArray[np.float64], "station 3"]

#: Number of faces with the nearest middles that are tried for each point.
CANDIDATES = 16
#: Largest distance of a point from its face, relative to the size of the face; curved faces deviate less from a cone.
MAX_DISTANCE = 0.02
#: Distance from a face, relative to the coordinates of the point, below which no other faces are tried.
TOUCHING = 1e-12
#: Number of Gauss-Newton steps; on nearly flat faces the third step is round-off.
MAX_STEPS = 8


def find_named_faces(mesh: Mesh, line: str, face_set: str) -> Faces:
    """Faces of the set on which a line or a point lies.

    Raises
    ------
    MeshError
        An unknown face set.
    """
    if face_set not in mesh.face_sets:
        known = ", ".join(sorted(mesh.face_sets)) or "none"
        raise MeshError(f'the line "{line}" lies on the face set "{face_set}", but the mesh has {known}')
    return mesh.face_sets[face_set]


def find_station_weights(mesh: Mesh, name: str, faces: Faces, stations: Places) -> sp.csr_array:
    """Weights of the nodes that give the displacement of points on faces.

    A point beside its face is moved to the nearest point of the face. The weights of each point sum to one, and their
    sum with the nodes' coordinates is the point: nodal forces from a force on it have its resultant and moment.

    Parameters
    ----------
    mesh
        The mesh.
    name
        Name of the points, for the message.
    faces
        Cell and local face of the candidate faces, shape (k, 2) [-].
    stations
        Coordinates of the points, shape (n_station, 3) [m].

    Returns
    -------
    Sparse weights, shape (n_station, n_node) [-].

    Raises
    ------
    MeshError
        No faces, or a point that is on none of them (`PointOffSurface`).
    """
    rows, columns, values = [], [], []
    for number, (element, local, nodes, at) in enumerate(_find_carriers(mesh, name, faces, stations)):
        on_face = list(element.faces[local])
        rows.append(np.full(len(on_face), number))
        columns.append(nodes[on_face])
        values.append(element.shape(at[None])[0, on_face])
    weights = sp.coo_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(len(stations), mesh.n_node)
    )
    return sp.csr_array(weights)


def find_station_normals(
    mesh: Mesh, name: str, faces: Faces, stations: Places
) -> Float[NDArray[np.float64], "station 3"]:
    """Outward unit normals of the faces on which points lie, shape (n_station, 3) [-].

    Arguments and errors are those of `find_station_weights`.
    """
    result = np.empty((len(stations), 3))
    for number, (element, local, nodes, at) in enumerate(_find_carriers(mesh, name, faces, stations)):
        _, along = find_face_frame(element, local)
        u, v = np.einsum("aj,tj,ai->ti", element.gradient(at[None])[0], along, mesh.points[nodes])
        normal = np.cross(u, v)
        result[number] = normal / np.linalg.norm(normal)
    return result


#: Element of the cell of a face, local face, nodes of the cell, and reference coordinates of a point on the face.
Carrier: TypeAlias = tuple[Element, int, Int[NDArray[np.int64], " node"], Float[NDArray[np.float64], " 3"]]


def _find_carriers(mesh: Mesh, name: str, faces: Faces, stations: Places) -> list[Carrier]:
    """Face on which each point lies, and the reference coordinates of the point."""
    if not len(faces):
        raise MeshError(f'"{name}": no face is close enough, so name the face that it lies on')
    host = {
        place: (element, local, nodes)
        for here, element, local, cells in mesh.face_groups(faces)
        for place, nodes in zip(here.tolist(), cells, strict=True)
    }
    hosts = [host[place] for place in range(len(faces))]
    middles = np.stack([mesh.points[nodes[list(element.faces[local])]].mean(axis=0) for element, local, nodes in hosts])
    near = cKDTree(middles).query(stations, k=min(CANDIDATES, len(hosts)))[1].reshape(len(stations), -1)
    result: list[Carrier] = []
    for number, (place, tried) in enumerate(zip(stations, near.tolist(), strict=True)):
        distance, at, best = _find_carrier(mesh, hosts, tried, place)
        element, local, nodes = hosts[best]
        size = float(np.ptp(mesh.points[nodes[list(element.faces[local])]], axis=0).max())
        if distance > MAX_DISTANCE * size:
            nearest = tuple((element.shape(at[None])[0] @ mesh.points[nodes]).tolist())
            raise PointOffSurface(
                f'station {number + 1} of "{name}", at {_millimetres(place)}, is {distance * 1e3:.4g} mm from the '
                f"nearest face of the mesh, whose point {_millimetres(nearest)} is next to it: move it there, or mesh "
                "with smaller cells",
                number,
                distance,
                nearest,
            )
        result.append((element, local, nodes, at))
    return result


def _millimetres(place: Sequence[float] | NDArray[np.float64]) -> str:
    return f"({', '.join(f'{round(1e3 * x, 6) + 0.0:.12g}' for x in place)}) mm"


def _find_carrier(
    mesh: Mesh, hosts: list[tuple[Element, int, NDArray[np.int64]]], tried: list[int], place: NDArray[np.float64]
) -> tuple[float, Float[NDArray[np.float64], " 3"], int]:
    """Distance and number of the face nearest to a point, with the reference coordinates of its nearest point."""
    best: tuple[float, NDArray[np.float64], int] = (np.inf, np.zeros(3), -1)
    for number in tried:
        element, local, nodes = hosts[number]
        distance, at = _find_nearest(element, local, mesh.points[nodes], place)
        if distance < best[0]:
            best = (distance, at, number)
        if distance < TOUCHING * float(np.abs(place).max()):
            break
    return best


def _find_nearest(
    element: Element, local: int, points: Float[NDArray[np.float64], "node 3"], place: Float[NDArray[np.float64], " 3"]
) -> tuple[float, Float[NDArray[np.float64], " 3"]]:
    """Distance of a point to a face, and the reference coordinates of the nearest point of the face."""
    origin, along = find_face_frame(element, local)
    is_triangle = len(element.corner_faces[local]) == 3
    at = np.full(2, 1 / 3 if is_triangle else 0.5)
    for _ in range(MAX_STEPS):
        xi = (origin + at @ along)[None]
        slope = np.einsum("aj,tj,ai->it", element.gradient(xi)[0], along, points)
        at = at + np.linalg.lstsq(slope, place - element.shape(xi)[0] @ points, rcond=None)[0]
        # The map may be invalid far outside the face.
        at = np.clip(at, -0.5, 1.5)
    at = np.clip(at, 0, 1)
    if is_triangle and at.sum() > 1:
        # Perpendicularly onto the third side.
        at = np.clip(at - (at.sum() - 1) / 2, 0, 1)
    xi = origin + at @ along
    return float(np.linalg.norm(element.shape(xi[None])[0] @ points - place)), xi
