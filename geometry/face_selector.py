"""Faces of a foreign solid found by what its user knows of them: name, colour, place, direction or area."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import cos, radians

import numpy as np

from geometry.errors import InputError
from geometry.part import MILLIMETRES_PER_METRE, FaceRegion, Shape
from geometry.solid import face_region

#: A face looks along a direction if its normal strays from it by less [rad].
ALONG = cos(radians(1))
#: A face is at a place if it is this near to it [mm].
AT = 1e-3
#: Faces that a refusal lists.
LISTED = 12


@dataclass(frozen=True, kw_only=True)
class FaceSelector:
    """Which faces are meant: those that fit everything that is given.

    Parameters
    ----------
    name
        Of the face in the file.
    colour
        "#RRGGBB".
    at
        A point on the face, shape (3,) [m].
    normal
        Direction out of the body in which a plane face looks, of any length.
    area
        Least and greatest area [m^2].

    Raises
    ------
    InputError
        Nothing is given, or a value that describes no face.
    """

    name: str | None = None
    colour: str | None = None
    at: tuple[float, float, float] | None = None
    normal: tuple[float, float, float] | None = None
    area: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if all(getattr(self, each.name) is None for each in fields(self)):
            raise InputError("a face is asked for by nothing: give its name, colour, at, normal or area")
        if self.colour is not None and not re.fullmatch(r"#[0-9A-Fa-f]{6}", self.colour):
            raise InputError(f'colour = "{self.colour}" is no colour: write it as "#RRGGBB", such as "#FF0000"')
        if self.normal is not None and not np.linalg.norm(self.normal) > 0:
            raise InputError(f"normal = {self.normal} has no direction: give the one in which the face looks")
        if self.area is not None and not 0 <= self.area[0] <= self.area[1]:
            raise InputError(f"area = {self.area} m^2 must be the least and the greatest area, in this order")

    def __str__(self) -> str:
        given = {each.name: getattr(self, each.name) for each in fields(self)}
        for name, power in (("at", 1), ("area", 2)):
            if given[name] is not None:
                values = ", ".join(f"{value * MILLIMETRES_PER_METRE**power:.6g}" for value in given[name])
                given[name] = f"({values}) mm{'' if power == 1 else '^2'}"
        return ", ".join(f"{name} = {value}" for name, value in given.items() if value is not None)


@dataclass(frozen=True, kw_only=True, eq=False)
class KnownFace:
    """A face of a solid with what its file says of it.

    Parameters
    ----------
    shape
        CadQuery face, in millimetres.
    name, colour
        Empty where the file gives none.
    """

    shape: Shape
    name: str = ""
    colour: str = ""

    def fits(self, selector: FaceSelector) -> bool:
        """Whether a selector means this face."""
        return all(
            [
                selector.name is None or self.name == selector.name,
                selector.colour is None or self.colour.upper() == selector.colour.upper(),
                selector.area is None
                or selector.area[0] <= self.shape.Area() / MILLIMETRES_PER_METRE**2 <= selector.area[1],
                selector.normal is None or self._looks(selector.normal),
                selector.at is None or self._is_at(selector.at),
            ]
        )

    def __str__(self) -> str:
        x, y, z = self.shape.Center().toTuple()
        said = f"{self.shape.geomType().lower()} of {self.shape.Area():.4g} mm^2 around ({x:.4g}, {y:.4g}, {z:.4g}) mm"
        return said + (f' "{self.name}"' if self.name else "") + (f" {self.colour}" if self.colour else "")

    def _looks(self, normal: tuple[float, float, float]) -> bool:
        if self.shape.geomType() != "PLANE":
            return False
        return bool(np.array(self.shape.normalAt().toTuple()) @ normal > ALONG * np.linalg.norm(normal))

    def _is_at(self, place: tuple[float, float, float]) -> bool:
        import cadquery as cq

        vertex = cq.Vertex.makeVertex(*(MILLIMETRES_PER_METRE * x for x in place))
        return bool(self.shape.distance(vertex) < AT)


def select_faces(
    body: str, known: Sequence[KnownFace], selectors: Mapping[str, Sequence[FaceSelector]]
) -> dict[str, FaceRegion]:
    """Regions by name, each of all faces that one of its selectors means.

    Parameters
    ----------
    body
        What the solid is called in refusals.
    known
        Its faces.
    selectors
        By the name that the region gets.

    Raises
    ------
    InputError
        A selector that no face fits, with the faces there are; or a face in two regions.
    """
    owner: dict[int, str] = {}
    regions = {}
    for region, wanted in selectors.items():
        chosen: dict[int, Shape] = {}
        for selector in wanted:
            fitting = [k for k, face in enumerate(known) if face.fits(selector)]
            if not fitting:
                there = "; ".join(map(str, known[:LISTED])) + ("; ..." if len(known) > LISTED else "")
                raise InputError(f'no face of {body} fits "{region}" ({selector}): it has {there}')
            chosen |= {k: known[k].shape for k in fitting}
        for k in chosen:
            if owner.setdefault(k, region) != region:
                raise InputError(
                    f'{body}: the {known[k]} is in "{owner[k]}" and in "{region}": say more precisely which is meant'
                )
        regions[region] = face_region(region, tuple(chosen.values()))
    return regions
