"""Select faces of an imported solid by name, colour, position, normal or area."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from difflib import SequenceMatcher
from math import degrees, sqrt

import numpy as np

from geometry.errors import InputError, SelectorError
from geometry.part import MILLIMETRES_PER_METRE, FaceRegion, Shape
from geometry.solid import face_region

#: Largest angle between the normal of a face and the wanted direction [degree].
ALONG = 1.0
#: Distance from a criterion for a face with another colour, or that is not plane; equal to that of the opposite normal
#: [-].
MISMATCH = 1.0
#: Largest distance of a face from a given point [mm].
AT = 1e-3
#: Largest number of faces that an error message lists.
LISTED = 12


@dataclass(frozen=True, kw_only=True)
class FaceSelector:
    """Criteria for faces; a face must satisfy all given criteria.

    Parameters
    ----------
    name
        Name of the face in the file.
    colour
        Colour as "#RRGGBB".
    at
        Point on the face, shape (3,) [m].
    normal
        Outward normal of a plane face, of any length.
    area
        Smallest and largest area [m^2].

    Raises
    ------
    InputError
        No criterion, or an invalid value.
    """

    name: str | None = None
    colour: str | None = None
    at: tuple[float, float, float] | None = None
    normal: tuple[float, float, float] | None = None
    area: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if all(getattr(self, item.name) is None for item in fields(self)):
            raise InputError("a face has no selector: give its name, colour, at, normal or area")
        if self.colour is not None and not re.fullmatch(r"#[0-9A-Fa-f]{6}", self.colour):
            raise InputError(f'colour = "{self.colour}" is not a colour: write it as "#RRGGBB", such as "#FF0000"')
        if self.normal is not None and not np.linalg.norm(self.normal) > 0:
            raise InputError(f"normal = {self.normal} has no direction: give the outward normal of the face")
        if self.area is not None and not 0 <= self.area[0] <= self.area[1]:
            raise InputError(f"area = {self.area} m^2 must be the smallest and the largest area, in this order")

    def __str__(self) -> str:
        given = {item.name: getattr(self, item.name) for item in fields(self)}
        for name, power in (("at", 1), ("area", 2)):
            if given[name] is not None:
                values = ", ".join(f"{value * MILLIMETRES_PER_METRE**power:.6g}" for value in given[name])
                given[name] = f"({values}) mm{'' if power == 1 else '^2'}"
        return ", ".join(f"{name} = {value}" for name, value in given.items() if value is not None)


@dataclass(frozen=True, kw_only=True, eq=False)
class KnownFace:
    """Face of a solid with its name and colour in the file.

    Parameters
    ----------
    shape
        CadQuery face, in millimetres.
    name, colour
        Name and colour; empty if the file gives none.
    """

    shape: Shape
    name: str = ""
    colour: str = ""

    def fits(self, selector: FaceSelector) -> bool:
        """Whether the face satisfies a selector."""
        return not any(self.misfits(selector))

    def misfits(self, selector: FaceSelector) -> Iterator[tuple[float, str]]:
        """Distances of the face from the criteria that it does not satisfy [-], and its values as text."""
        if selector.name is not None and self.name != selector.name:
            alike = SequenceMatcher(a=self.name.lower(), b=selector.name.lower()).ratio()
            yield 1 - alike, f'its name is "{self.name}"' if self.name else "it has no name"
        if selector.colour is not None and self.colour.upper() != selector.colour.upper():
            yield MISMATCH, f"its colour is {self.colour}" if self.colour else "it has no colour"
        area = self.shape.Area()
        low, high = (item * MILLIMETRES_PER_METRE**2 for item in selector.area or (0.0, np.inf))
        if not low <= area <= high:
            yield max(low - area, area - high) / max(low, area), f"its area is {area:.6g} mm^2"
        if selector.normal is not None:
            yield from self._turned(selector.normal)
        if selector.at is not None:
            import cadquery as cq

            distance = self.shape.distance(cq.Vertex.makeVertex(*(MILLIMETRES_PER_METRE * x for x in selector.at)))
            if distance >= AT:
                yield distance / sqrt(area), f"it is {distance:.4g} mm from that point"

    def __str__(self) -> str:
        x, y, z = self.shape.Center().toTuple()
        description = (
            f"{self.shape.geomType().lower()} of {self.shape.Area():.4g} mm^2 around ({x:.4g}, {y:.4g}, {z:.4g}) mm"
        )
        return description + (f' "{self.name}"' if self.name else "") + (f" {self.colour}" if self.colour else "")

    def _turned(self, normal: tuple[float, float, float]) -> Iterator[tuple[float, str]]:
        if self.shape.geomType() != "PLANE":
            yield MISMATCH, "it is not plane"
            return
        own = np.array(self.shape.normalAt().toTuple()) + 0.0  # no negative zeros
        wanted = np.array(normal) / np.linalg.norm(normal)
        angle = degrees(np.arctan2(np.linalg.norm(np.cross(own, wanted)), own @ wanted))
        if angle >= ALONG:
            x, y, z = own
            yield angle / 180, f"its normal is ({x:.4g}, {y:.4g}, {z:.4g}), {angle:.3g} degrees off"


def select_faces(
    body: str, known: Sequence[KnownFace], selectors: Mapping[str, Sequence[FaceSelector]]
) -> dict[str, FaceRegion]:
    """Regions by name, each of all faces that satisfy one of its selectors.

    Parameters
    ----------
    body
        Name of the solid, for messages.
    known
        Faces of the solid.
    selectors
        Selectors by the name of their region.

    Raises
    ------
    SelectorError
        A selector that fits no face, with the nearest face and a list of faces; or a face in two regions.
    """
    owner: dict[int, str] = {}
    regions = {}
    for region, wanted in selectors.items():
        chosen: dict[int, Shape] = {}
        for number, selector in enumerate(wanted):
            fitting = [k for k, face in enumerate(known) if face.fits(selector)]
            if not fitting:
                there = "; ".join(map(str, known[:LISTED])) + ("; ..." if len(known) > LISTED else "")
                raise SelectorError(
                    f'no face of {body} fits "{region}" ({selector}): {_nearest(known, selector)}; there are: {there}',
                    region,
                    number,
                )
            for k in fitting:
                if owner.setdefault(k, region) != region:
                    raise SelectorError(
                        f'{body}: the {known[k]} is in "{owner[k]}" and in "{region}": say more precisely which is '
                        "meant",
                        region,
                        number,
                    )
            chosen |= {k: known[k].shape for k in fitting}
        regions[region] = face_region(region, tuple(chosen.values()))
    return regions


def _nearest(known: Sequence[KnownFace], selector: FaceSelector) -> str:
    """Text about the face that fails the fewest criteria by the smallest distances, with the remedy."""
    missed = [list(face.misfits(selector)) for face in known]
    best = min(range(len(known)), key=lambda k: (len(missed[k]), sum(far for far, _ in missed[k])))
    clauses = " and ".join(words for _, words in missed[best])
    return f"the nearest is the {known[best]}, but {clauses}: give the properties of the intended face"
