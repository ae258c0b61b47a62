"""Placement of a body in the rig: mirrored or not at y = 0 of its local axes, and translated."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.interface import ContactLine
from geometry.part import MILLIMETRES_PER_METRE, FaceRegion, Part, Point, Shape

Points = Float[NDArray[np.float64], "*k 3"]


def _origin() -> Point:
    return np.zeros(3)


@dataclass(frozen=True, kw_only=True, eq=False)
class Placement:
    """Transformation from the local axes of a body to the axes of the rig.

    Parameters
    ----------
    mirrored
        Whether the body is mirrored at its plane y = 0 before it is moved.
    shift
        Position of its origin, shape (3,) [m].
    """

    mirrored: bool = False
    shift: Point = field(default_factory=_origin)

    def directions(self, vectors: Points) -> Points:
        """Vectors transformed to the rig's axes, shape (..., 3)."""
        return vectors * np.array([1.0, -1.0, 1.0]) if self.mirrored else vectors

    def points(self, places: Points) -> Points:
        """Points transformed to the rig's axes, shape (..., 3) [m]."""
        return self.directions(places) + self.shift

    def line(self, line: ContactLine) -> ContactLine:
        """Contact line transformed to the rig's axes."""
        return ContactLine(
            name=line.name,
            stations=self.points(line.stations),
            normal=self.directions(line.normal),
            tangents=self.directions(line.tangents),
            tributary_length=line.tributary_length,
        )

    def part(self, part: Part, name: str) -> Part:
        """Part transformed to the rig's axes, with a new name."""
        solid = self._moved(part.solid)
        # Faces are taken from the moved solid by number; faces moved separately would not belong to it.
        number = {face: i for i, face in enumerate(part.solid.Faces())}
        moved = solid.Faces()
        return Part(
            name=name,
            solid=solid,
            faces={
                name: FaceRegion(
                    faces=tuple(moved[number[face]] for face in region.faces),
                    area=region.area,
                    centre=self.points(region.centre),
                )
                for name, region in part.faces.items()
            },
            points={name: self.points(point) for name, point in part.points.items()},
            contact_lines={name: self.line(line) for name, line in part.contact_lines.items()},
        )

    def _moved(self, shape: Shape) -> Shape:
        import cadquery as cq

        turned = shape.mirror("XZ") if self.mirrored else shape
        return turned.translate(cq.Vector(*self.shift) * MILLIMETRES_PER_METRE)
