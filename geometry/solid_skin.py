"""Surface of a solid for a mesher: triangles with the numbers of their faces, and projections to faces, edges, corners.

Arguments and results are in metres; the CAD kernel uses millimetres.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import cos, radians

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from geometry.part import MILLIMETRES_PER_METRE, Point, Shape

Points = Float[NDArray[np.float64], "k 3"]

#: Angle between two faces below which they are smoothly connected, without an edge for the mesher [rad].
SMOOTH = radians(5)
#: Largest rotation of the normal over a triangle [rad].
TURN = radians(6)


@dataclass(frozen=True, kw_only=True, eq=False)
class Facets:
    """Closed surface of triangles.

    Parameters
    ----------
    points
        Points, shape (n_point, 3) [m]; points on edges belong to triangles of both sides.
    triangles
        Corners of the triangles, anticlockwise from outside, shape (n_triangle, 3) [-].
    face
        Number of the CAD face of each triangle, shape (n_triangle,) [-].
    """

    points: Float[NDArray[np.float64], "point 3"]
    triangles: Int[NDArray[np.int64], "triangle 3"]
    face: Int[NDArray[np.int64], " triangle"]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Edge:
    """Sharp edge: the two faces beside it, and its curve between two parameters."""

    faces: frozenset[int]
    curve: Shape
    range: tuple[float, float]


class SolidSkin:
    """Faces, sharp edges and corners of a CAD solid.

    Parameters
    ----------
    solid
        CadQuery solid, in millimetres.
    """

    def __init__(self, solid: Shape) -> None:
        from OCP.BRep import BRep_Tool

        self._solid = solid
        #: CAD faces, in the order of their numbers.
        self.faces: Sequence[Shape] = solid.Faces()
        self._surface = [BRep_Tool.Surface_s(face.wrapped) for face in self.faces]
        self._plane = [_plane(face) for face in self.faces]
        number = {face: i for i, face in enumerate(self.faces)}
        beside: dict[Shape, set[int]] = {}
        at: dict[Shape, set[int]] = {}
        for face, i in number.items():
            for edge in face.Edges():
                beside.setdefault(edge, set()).add(i)
            for vertex in face.Vertices():
                at.setdefault(vertex, set()).add(i)
        pairs = [(edge, frozenset(faces)) for edge, faces in beside.items() if len(faces) == 2]
        sharp = [self._is_sharp(edge, faces) for edge, faces in pairs]
        #: Group number of each face; smoothly connected faces have the same number, shape (n_face,) [-].
        self.group = _groups(
            len(self.faces), [faces for (_, faces), is_sharp in zip(pairs, sharp, strict=True) if not is_sharp]
        )
        self._edges = [_edge(edge, faces) for (edge, faces), is_sharp in zip(pairs, sharp, strict=True) if is_sharp]
        self._corners = np.array([vertex.toTuple() for vertex in at]).reshape(-1, 3) / MILLIMETRES_PER_METRE
        self._groups_at_corner = [{int(self.group[i]) for i in faces} for faces in at.values()]

    def facets(self, deflection: float) -> Facets:
        """Triangles whose distance from the solid is at most about `deflection` [m]."""
        from OCP.BRep import BRep_Tool
        from OCP.BRepMesh import BRepMesh_IncrementalMesh
        from OCP.BRepTools import BRepTools
        from OCP.TopLoc import TopLoc_Location

        # The kernel would keep an existing finer triangulation, so it is removed first.
        BRepTools.Clean_s(self._solid.wrapped)
        BRepMesh_IncrementalMesh(self._solid.wrapped, deflection * MILLIMETRES_PER_METRE, False, TURN, False)
        points, triangles, face, count = [], [], [], 0
        for i, cad_face in enumerate(self.faces):
            location = TopLoc_Location()
            result = BRep_Tool.Triangulation_s(cad_face.wrapped, location)
            move = location.Transformation()
            nodes = [result.Node(k).Transformed(move).Coord() for k in range(1, result.NbNodes() + 1)]
            corners = np.array([result.Triangle(k).Get() for k in range(1, result.NbTriangles() + 1)]) - 1
            if cad_face.wrapped.Orientation().name == "TopAbs_REVERSED":
                corners = corners[:, ::-1]
            points.append(np.array(nodes) / MILLIMETRES_PER_METRE)
            triangles.append(corners + count)
            face.append(np.full(len(corners), i))
            count += len(nodes)
        whole = np.concatenate(points)
        # Both faces at an edge have its points, equal up to round-off: one of each is kept.
        _, first, which = np.unique(np.round(whole, 9), axis=0, return_index=True, return_inverse=True)
        joined = which.ravel()[np.concatenate(triangles)]
        flat = (joined == np.roll(joined, 1, axis=1)).any(axis=1)
        return Facets(points=whole[first], triangles=joined[~flat], face=np.concatenate(face)[~flat])

    def to_face(self, face: int, points: Points) -> Points:
        """Nearest points on the unbounded surface of a face."""
        plane = self._plane[face]
        if plane is not None:
            origin, normal = plane
            return np.asarray(points - np.outer((points - origin) @ normal, normal))
        from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
        from OCP.gp import gp_Pnt

        result = points.copy()
        for k, point in enumerate(points * MILLIMETRES_PER_METRE):
            projection = GeomAPI_ProjectPointOnSurf(gp_Pnt(*map(float, point)), self._surface[face])
            if projection.NbPoints():
                result[k] = np.array(projection.NearestPoint().Coord()) / MILLIMETRES_PER_METRE
        return result

    def to_edge(self, groups: Iterable[int], point: Point) -> Point | None:
        """Nearest point on the sharp edges between any two of the groups of faces; None if there is no such edge."""
        wanted = set(groups)
        result = [
            _on_edge(edge, point) for edge in self._edges if len({int(self.group[i]) for i in edge.faces} & wanted) == 2
        ]
        return min(result, key=lambda place: float(np.linalg.norm(place - point)), default=None)

    def to_corner(self, groups: Iterable[int], point: Point) -> Point | None:
        """Nearest corner at which all the groups of faces meet; None if there is no such corner."""
        wanted = set(groups)
        here = [k for k, meeting in enumerate(self._groups_at_corner) if wanted <= meeting]
        if not here:
            return None
        return np.asarray(self._corners[here][np.linalg.norm(self._corners[here] - point, axis=1).argmin()])

    def _is_sharp(self, edge: Shape, faces: frozenset[int]) -> bool:
        middle = edge.positionAt(0.5)
        first, second = (np.array(self.faces[i].normalAt(middle).toTuple()) for i in faces)
        return bool(first @ second < cos(SMOOTH))


def _plane(face: Shape) -> tuple[Point, Point] | None:
    if face.geomType() != "PLANE":
        return None
    return np.array(face.Center().toTuple()) / MILLIMETRES_PER_METRE, np.array(face.normalAt().toTuple())


def _groups(count: int, joined: Iterable[frozenset[int]]) -> Int[NDArray[np.int64], " face"]:
    group = np.arange(count)
    for faces in joined:
        first, second = (group[i] for i in faces)
        group[group == second] = first
    return group


def _edge(edge: Shape, faces: frozenset[int]) -> _Edge:
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve

    adaptor = BRepAdaptor_Curve(edge.wrapped)
    first, last = adaptor.FirstParameter(), adaptor.LastParameter()
    return _Edge(faces=faces, curve=BRep_Tool.Curve_s(edge.wrapped, first, last), range=(first, last))


def _on_edge(edge: _Edge, point: Point) -> Point:
    from OCP.GeomAPI import GeomAPI_ProjectPointOnCurve
    from OCP.gp import gp_Pnt

    at = point * MILLIMETRES_PER_METRE
    projection = GeomAPI_ProjectPointOnCurve(gp_Pnt(*map(float, at)), edge.curve, *edge.range)
    result = [projection.NearestPoint()] if projection.NbPoints() else []
    result += [edge.curve.Value(end) for end in edge.range]
    places = np.array([place.Coord() for place in result])
    return np.asarray(places[np.linalg.norm(places - at, axis=1).argmin()] / MILLIMETRES_PER_METRE)
