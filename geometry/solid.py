"""CadQuery operations behind the builders: metres in, solids in millimetres out, faces found by where they lie.

CadQuery is imported inside the functions, since that takes seconds which whoever needs no solid should not wait.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import GeometryError
from geometry.part import MILLIMETRES_PER_METRE, FaceRegion, Point, Shape

# Planes closer than this are one plane [mm]: ten times the kernel's own tolerance for coincidence, a ten-thousandth of
# the smallest dimension that is accepted.
SAME_PLACE = 1e-6
# Direction cosines of a plane that is one of the axes' planes differ from 0 and 1 by round-off alone.
PARALLEL = 1e-9

Section = Sequence[tuple[float, float]]
# Says of a face's centroid [m] whether the face is meant.
Chooser = Callable[[Point], bool | np.bool_]


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Shape:
    """Axis-parallel box between two corners [m]."""
    import cadquery as cq

    corner = cq.Vector(*low) * MILLIMETRES_PER_METRE
    size = cq.Vector(*high) * MILLIMETRES_PER_METRE - corner
    return cq.Solid.makeBox(size.x, size.y, size.z, corner)


def prism(section: Section, height: float) -> Shape:
    """Prism over a polygon of points (x, y) [m] in the plane z = 0, up to z = height [m]."""
    import cadquery as cq

    corners = [cq.Vector(MILLIMETRES_PER_METRE * x, MILLIMETRES_PER_METRE * y, 0.0) for x, y in section]
    # A bevel of no width makes two corners one; the kernel passes over the second.
    outline = cq.Wire.makePolygon(corners, close=True)
    return cq.Solid.extrudeLinear(outline, [], cq.Vector(0.0, 0.0, MILLIMETRES_PER_METRE * height))


def plate(section: Section, low: float, high: float) -> Shape:
    """Prism over a polygon of points (y, z) [m], from x = low to x = high [m]."""
    import cadquery as cq

    corners = [cq.Vector(low, y, z) * MILLIMETRES_PER_METRE for y, z in section]
    outline = cq.Wire.makePolygon(corners, close=True)
    return cq.Solid.extrudeLinear(outline, [], cq.Vector(MILLIMETRES_PER_METRE * (high - low), 0.0, 0.0))


def cone_along_y(*, start: float, end: float, start_radius: float, end_radius: float, axis_height: float) -> Shape:
    """Truncated cone about the line x = 0, z = axis_height, from y = start to y = end [m]; see `turned_about_y`."""
    return turned_about_y([(start, start_radius), (end, end_radius)], axis_height=axis_height)


def turned_about_y(outline: Section, axis_height: float = 0.0) -> Shape:
    """Body of revolution about the line x = 0, z = axis_height, with an outline of points (y, radius) [m].

    Its seams are the generators on top (+z): a groove cut with it has an edge of the CAD model as its crest, and that
    edge carries the contact line.
    """
    import cadquery as cq

    profile = [(outline[0][0], 0.0), (outline[-1][0], 0.0), *reversed(outline)]
    corners = [
        cq.Vector(0.0, MILLIMETRES_PER_METRE * y, MILLIMETRES_PER_METRE * (axis_height + radius))
        for y, radius in profile
    ]
    centre = MILLIMETRES_PER_METRE * axis_height
    return cq.Solid.revolve(
        cq.Wire.makePolygon(corners, close=True), [], 360, cq.Vector(0, 0, centre), cq.Vector(0, 1, centre)
    )


def single_solid(body: str, shape: Shape) -> Shape:
    """The one valid solid in a shape.

    Raises
    ------
    GeometryError
        The shape is not valid, or is several bodies or none.
    """
    solids = shape.Solids()
    if len(solids) != 1:
        raise GeometryError(
            f"the {body} consists of {len(solids)} separate bodies: choose dimensions that give exactly one"
        )
    if not solids[0].isValid():
        raise GeometryError(f"the {body} is not a valid solid: choose dimensions whose surfaces do not cross")
    return solids[0]


def plane_faces(
    solid: Shape, *, normal: tuple[int, int, int], offset: float, where: Chooser = lambda _: True
) -> tuple[Shape, ...]:
    """Faces of a solid that lie in the plane normal . x = offset and look along the normal.

    Parameters
    ----------
    solid
        In millimetres.
    normal
        One of the six axis directions, out of the body.
    offset
        Distance of the plane from the origin along the normal [m].
    where
        Choice among them, by the centroid [m] of each.
    """
    direction = np.array(normal, dtype=np.float64)

    def lies_there(face: Shape) -> bool:
        if face.geomType() != "PLANE":
            return False
        centre = np.array(face.Center().toTuple())
        looks_there = direction @ np.array(face.normalAt().toTuple()) > 1 - PARALLEL
        in_plane = abs(direction @ centre - MILLIMETRES_PER_METRE * offset) < SAME_PLACE
        return bool(looks_there and in_plane and where(centre / MILLIMETRES_PER_METRE))

    return tuple(face for face in solid.Faces() if lies_there(face))


def curved_faces(solid: Shape, *, where: Chooser) -> tuple[Shape, ...]:
    """Faces of a solid that are not plane, chosen by their centroid."""
    # Not asked for cones: with vanishing taper the kernel makes cylinders or surfaces of revolution of them.
    return tuple(
        face
        for face in solid.Faces()
        if face.geomType() != "PLANE" and where(np.array(face.Center().toTuple()) / MILLIMETRES_PER_METRE)
    )


def faces_at(solid: Shape, centre: Point) -> tuple[Shape, ...]:
    """Faces of a solid whose centroid is a point [m]."""
    return tuple(
        face
        for face in solid.Faces()
        if np.abs(np.array(face.Center().toTuple()) - MILLIMETRES_PER_METRE * centre).max() < SAME_PLACE
    )


def face_region(name: str, faces: tuple[Shape, ...]) -> FaceRegion:
    """Faces as one region, with its area and centroid.

    Raises
    ------
    GeometryError
        There is no face to name.
    """
    if not faces:
        raise GeometryError(f'no face of the solid is its "{name}": choose dimensions that leave one')
    areas = np.array([face.Area() for face in faces])
    centres: Float[NDArray[np.float64], "face 3"] = np.array([face.Center().toTuple() for face in faces])
    return FaceRegion(
        faces=faces,
        area=float(areas.sum()) / MILLIMETRES_PER_METRE**2,
        centre=areas @ centres / areas.sum() / MILLIMETRES_PER_METRE,
    )
