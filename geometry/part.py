"""Body for other packages: one solid with named faces, points and contact lines."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.interface import ContactLine
from geometry.read_only_array import freeze_fields, read_only

# A CadQuery shape, in millimetres. The actual type would import CadQuery with this module, which takes seconds.
Shape: TypeAlias = Any

MILLIMETRES_PER_METRE = 1e3

Point = Float[NDArray[np.float64], " 3"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FaceRegion:
    """Named region of one or more faces of a solid.

    Parameters
    ----------
    faces
        CadQuery faces, in millimetres.
    area
        Sum of their areas [m^2].
    centre
        Common centroid of the faces, shape (3,) [m].
    """

    faces: tuple[Shape, ...]
    area: float
    centre: Point

    def __post_init__(self) -> None:
        object.__setattr__(self, "faces", tuple(self.faces))
        freeze_fields(self, "centre")


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """One solid with named faces, points and contact lines.

    Parameters
    ----------
    name
        Name of the part in files.
    solid
        CadQuery solid, in millimetres; all other lengths are in metres.
    faces
        Regions of its surface by name.
    points
        Named points on its surface, each of shape (3,) [m].
    contact_lines
        Lines along which it can touch other bodies, by name.
    """

    name: str
    solid: Shape
    faces: Mapping[str, FaceRegion] = field(default_factory=dict)
    points: Mapping[str, Point] = field(default_factory=dict)
    contact_lines: Mapping[str, ContactLine] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "faces", MappingProxyType(dict(self.faces)))
        points = {name: read_only(point) for name, point in self.points.items()}
        object.__setattr__(self, "points", MappingProxyType(points))
        object.__setattr__(self, "contact_lines", MappingProxyType(dict(self.contact_lines)))

    @property
    def volume(self) -> float:
        """Volume of the solid [m^3], to about 1e-12 relative on planes and cones."""
        # Without a tolerance, the kernel's fixed quadrature is accurate to only nine digits for curved faces.
        return float(self.solid.Volume(1e-9)) / MILLIMETRES_PER_METRE**3

    @property
    def bounding_box(self) -> Float[NDArray[np.float64], "2 3"]:
        """Lowest and highest corner of the axis-parallel box around the solid [m]."""
        box = self.solid.BoundingBox()
        corners = [[box.xmin, box.ymin, box.zmin], [box.xmax, box.ymax, box.zmax]]
        return np.array(corners, dtype=np.float64) / MILLIMETRES_PER_METRE
