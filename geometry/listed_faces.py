"""List the faces of a solid with kind, area, position, a point on each, and triangles for drawing."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from geometry.part import MILLIMETRES_PER_METRE
from geometry.step_part import StepBody

#: Largest distance of a triangle from a curved face, relative to the size of the solid [-].
CHORD = 2e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class ListedFace:
    """Face of a solid.

    Parameters
    ----------
    name
        Name in the file; empty if it has none.
    kind
        Kind of surface, such as "plane" or "cylinder".
    area
        Area [m^2].
    centre
        Centre of area, which need not lie on the face, shape (3,) [m].
    inside
        Point on the face, away from its edges, shape (3,) [m].
    normal
        Outward normal of a plane, shape (3,) [-]; None for other surfaces.
    corners, triangles
        Corners of its triangles [m], and three corner numbers for each triangle.
    """

    name: str
    kind: str
    area: float
    centre: Float[NDArray[np.float64], " 3"]
    inside: Float[NDArray[np.float64], " 3"]
    normal: Float[NDArray[np.float64], " 3"] | None
    corners: Float[NDArray[np.float64], "corner 3"]
    triangles: Int[NDArray[np.int64], "triangle 3"]


def list_faces(body: StepBody) -> list[ListedFace]:
    """List the faces of a solid, in the order of its file.

    Parameters
    ----------
    body
        Solid of a STEP file.
    """
    chord = CHORD * float(body.solid.BoundingBox().DiagonalLength)
    listed = []
    for face in body.faces:
        vertices, cells = face.shape.tessellate(chord, 0.3)
        corners = np.array([vertex.toTuple() for vertex in vertices]) / MILLIMETRES_PER_METRE
        triangles = np.array(cells, dtype=np.int64)
        plane = face.shape.geomType() == "PLANE"
        listed.append(
            ListedFace(
                name=face.name,
                kind=face.shape.geomType().lower(),
                area=float(face.shape.Area()) / MILLIMETRES_PER_METRE**2,
                centre=np.array(face.shape.Center().toTuple()) / MILLIMETRES_PER_METRE,
                inside=_inside(face.shape, corners, triangles),
                normal=np.array(face.shape.normalAt().toTuple()) + 0.0 if plane else None,
                corners=corners,
                triangles=triangles,
            )
        )
    return listed


def corner_points(body: StepBody) -> Float[NDArray[np.float64], "corner 3"]:
    """Vertices of a solid, which include seam points of edges without corners [m]."""
    corners = [vertex.toTuple() for vertex in body.solid.Vertices()]
    return np.array(corners) / MILLIMETRES_PER_METRE


def _inside(
    face: object, corners: Float[NDArray[np.float64], "corner 3"], triangles: Int[NDArray[np.int64], "triangle 3"]
) -> Float[NDArray[np.float64], " 3"]:
    """Point of the face nearest to the middle of its largest triangle."""
    import cadquery as cq
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape

    sides = corners[triangles[:, 1:]] - corners[triangles[:, :1]]
    largest = int(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).argmax())
    middle = corners[triangles[largest]].mean(axis=0) * MILLIMETRES_PER_METRE
    nearest = BRepExtrema_DistShapeShape(face.wrapped, cq.Vertex.makeVertex(*middle).wrapped)  # type: ignore[attr-defined]
    point = nearest.PointOnShape1(1)
    return np.array([point.X(), point.Y(), point.Z()]) / MILLIMETRES_PER_METRE
