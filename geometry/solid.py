"""CadQuery operations for building solids: lengths in metres, solids in millimetres, faces selected by position.

CadQuery is imported inside the functions, because the import takes seconds and many uses need no solid.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import GeometryError
from geometry.part import MILLIMETRES_PER_METRE, FaceRegion, Point, Shape

# Distance below which planes and points coincide [mm]: ten times the kernel's tolerance for coincidence, and a
# ten-thousandth of the smallest accepted dimension.
SAME_PLACE = 1e-6
# Tolerance for round-off of direction cosines of planes normal to an axis.
PARALLEL = 1e-9

Section = Sequence[tuple[float, float]]
# Function that returns whether a face is selected, from its centroid [m].
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
    # With a bevel of zero width two corners coincide; the kernel skips the second.
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

    Its seams are the generators on top (+z): the crest of a groove cut with it is an edge of the CAD model, with the
    contact line on it.
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
    """The only valid solid in a shape.

    Raises
    ------
    GeometryError
        The shape is not valid, or does not have exactly one body.
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
    """Faces of a solid in the plane normal . x = offset whose outward normal is the given one.

    Parameters
    ----------
    solid
        CadQuery solid, in millimetres.
    normal
        Outward normal, one of the six axis directions.
    offset
        Distance of the plane from the origin along the normal [m].
    where
        Selection among these faces by their centroids [m].
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
    """Faces of a solid that are not plane, selected by their centroids."""
    # Not restricted to cones, because with small taper the kernel replaces them by cylinders or surfaces of revolution.
    return tuple(
        face
        for face in solid.Faces()
        if face.geomType() != "PLANE" and where(np.array(face.Center().toTuple()) / MILLIMETRES_PER_METRE)
    )


def faces_at(solid: Shape, centre: Point) -> tuple[Shape, ...]:
    """Faces of a solid whose centroid is at a point [m]."""
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
        No faces.
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
