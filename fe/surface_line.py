"""Contact lines on the surface of a mesh: between two points of a named face, or along the common edge of two faces."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from fe.errors import MeshError
from fe.host_face import Faces, find_named_faces, find_station_normals
from fe.mesh import Mesh
from geometry.interface import N_STATION, ContactLine, straight_contact_line
from geometry.part import Point

#: Number of straight pieces that measure the length of a side of a cell; the error for an eighth of a circle is 1e-5.
PIECES = 32
#: Smallest part of a line's unit direction in the surface; below it, the line is perpendicular to the surface.
SQUARE = 1e-8

Places = Float[NDArray[np.float64], "station 3"]
#: First corner, last corner and midside node of sides, -1 for the midside node of straight sides.
Sides = Int[NDArray[np.int64], "side 3"]


def line_between(mesh: Mesh, name: str, on: str, ends: tuple[Point, Point], n_station: int = N_STATION) -> ContactLine:
    """Contact line with evenly spaced stations between two points of a face; the normals are those of the mesh.

    Parameters
    ----------
    mesh
        The mesh.
    name
        Name of the line.
    on
        Face set on which the line lies.
    ends
        First and last point of the line [m].
    n_station
        Number of stations, ends included [-].

    Raises
    ------
    MeshError
        An unknown face, two equal ends, or a station that is not on the face.
    GeometryError
        Fewer than two stations.
    """
    start, end = (np.asarray(point, dtype=np.float64) for point in ends)
    if not np.linalg.norm(end - start) > 0:
        raise MeshError(f'the line "{name}" begins where it ends: give two points')
    # Only stations and tributary lengths of this line are used; the frames are computed in `_make_framed_line`.
    plain = straight_contact_line(
        name=name, start=start, end=end, normal=np.zeros(3), across=np.zeros(3), n_station=n_station
    )
    along = np.tile((end - start) / np.linalg.norm(end - start), (n_station, 1))
    return _make_framed_line(mesh, name, on, plain.stations, along, plain.tributary_length)


def line_along_edge(
    mesh: Mesh, name: str, on: tuple[str, str], n_station: int = N_STATION, start: Point | None = None
) -> ContactLine:
    """Contact line with evenly spaced stations on the edge in which two faces meet; normals are those of the first.

    The line runs anticlockwise about the first face, seen from outside. A closed line, such as the rim of a bore,
    begins at its corner node nearest to `start`, by default with the smallest x; no station is repeated at the end.

    Parameters
    ----------
    mesh
        The mesh.
    name
        Name of the line.
    on
        Two face sets.
    n_station
        Number of stations [-].
    start
        Point near the start of the line [m]; an open line begins at its nearer end.

    Raises
    ------
    MeshError
        An unknown face; faces that do not meet, or meet in several edges; fewer than two stations.
    """
    if n_station < 2:
        raise MeshError(f'the line "{name}" cannot have {n_station} stations: give 2 or more')
    first, second = (_list_sides(mesh, find_named_faces(mesh, name, face_set)) for face_set in on)
    shared = first[_find_members(first, second)]
    what = f'the line "{name}": the faces "{on[0]}" and "{on[1]}"'
    if not len(shared):
        raise MeshError(f"{what} do not meet: name two that share an edge")
    ordered, is_closed = _chain_sides(shared, what)
    if start is not None and not is_closed:
        far, near = (np.linalg.norm(mesh.points[ordered[k, c]] - start) for k, c in ((0, 0), (-1, 1)))
        if near < far:
            ordered = ordered[::-1, [1, 0, 2]]
    if is_closed:
        corners = mesh.points[ordered[:, 0]]
        begin = np.lexsort(corners.T[::-1])[0] if start is None else np.linalg.norm(corners - start, axis=1).argmin()
        ordered = np.roll(ordered, -int(begin), axis=0)
    places, along, lengths = _space_evenly(mesh, ordered, n_station, is_closed=is_closed)
    return _make_framed_line(mesh, name, on[0], places, along, lengths)


def _make_framed_line(
    mesh: Mesh, name: str, on: str, places: Places, along: Places, lengths: Float[NDArray[np.float64], " station"]
) -> ContactLine:
    normal = find_station_normals(mesh, name, find_named_faces(mesh, name, on), places)
    tangent = along - (along * normal).sum(axis=1, keepdims=True) * normal
    size = np.linalg.norm(tangent, axis=1, keepdims=True)
    if not (size > SQUARE).all():
        raise MeshError(f'the line "{name}" is perpendicular to the face "{on}": give two points of that face')
    tangent /= size
    return ContactLine(
        name=name,
        stations=places,
        normal=normal,
        tangents=np.stack([tangent, np.cross(normal, tangent)], axis=1),
        tributary_length=lengths,
    )


def _list_sides(mesh: Mesh, faces: Faces) -> Sides:
    """Sides of faces, each oriented as its face."""
    result = [np.empty((0, 3), dtype=np.int64)]
    for _, element, local, cells in mesh.face_groups(faces):
        on, n_corner = cells[:, element.faces[local]], len(element.corner_faces[local])
        for k in range(n_corner):
            middle = on[:, n_corner + k] if on.shape[1] > n_corner else np.full(len(on), -1)
            result.append(np.column_stack([on[:, k], on[:, (k + 1) % n_corner], middle]))
    return np.concatenate(result)


def _find_members(sides: Sides, others: Sides) -> NDArray[np.bool_]:
    known = {frozenset(pair) for pair in others[:, :2].tolist()}
    return np.array([frozenset(pair) in known for pair in sides[:, :2].tolist()], dtype=bool)


def _chain_sides(sides: Sides, what: str) -> tuple[Sides, bool]:
    """Sides in consecutive order, and whether the last side meets the first."""
    after = {int(side[0]): k for k, side in enumerate(sides)}
    ends = sorted(set(sides[:, 0].tolist()) - set(sides[:, 1].tolist()))
    nodes, which = np.unique(sides[:, :2], return_inverse=True)
    pairs = which.reshape(-1, 2)
    graph = sp.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(nodes), len(nodes)))
    n_edge = connected_components(graph, directed=False)[0]
    if n_edge > 1 or len(after) < len(sides):
        raise MeshError(f"{what} meet in {max(n_edge, 2)} edges: split the faces, or give the line by two points")
    node = ends[0] if ends else int(sides[0, 0])
    order: list[int] = []
    while node in after and len(order) < len(sides):
        order.append(after[node])
        node = int(sides[order[-1], 1])
    return sides[order], not ends


def _space_evenly(
    mesh: Mesh, sides: Sides, n_station: int, *, is_closed: bool
) -> tuple[Places, Places, Float[NDArray[np.float64], " station"]]:
    """Evenly spaced points along the sides, directions of the line there, and tributary lengths [m]."""
    first, last = mesh.points[sides[:, 0]], mesh.points[sides[:, 1]]
    middle = np.where(sides[:, 2:] >= 0, mesh.points[sides[:, 2]], (first + last) / 2)
    at = np.linspace(0, 1, PIECES + 1)
    curve = np.stack([(1 - at) * (1 - 2 * at), 4 * at * (1 - at), at * (2 * at - 1)], axis=1)
    points = np.einsum("pc,csi->spi", curve, np.stack([first, middle, last]))
    pieces = np.linalg.norm(np.diff(points, axis=1), axis=2).ravel()
    way = np.concatenate([[0.0], np.cumsum(pieces)])
    wanted = way[-1] * (np.arange(n_station) / n_station if is_closed else np.linspace(0, 1, n_station))
    parameter = np.interp(wanted, way, np.arange(len(way)) / PIECES)
    side = np.minimum(parameter.astype(np.int64), len(sides) - 1)
    t = (parameter - side)[:, None]
    a, m, b = first[side], middle[side], last[side]
    places = (1 - t) * (1 - 2 * t) * a + 4 * t * (1 - t) * m + t * (2 * t - 1) * b
    along = (4 * t - 3) * a + 4 * (1 - 2 * t) * m + (4 * t - 1) * b
    lengths = np.full(n_station, way[-1] / (n_station if is_closed else n_station - 1))
    if not is_closed:
        lengths[[0, -1]] /= 2
    return places, along / np.linalg.norm(along, axis=1, keepdims=True), lengths
