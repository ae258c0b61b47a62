"""Faces of a foreign solid found by what its user knows of them: name, colour, place, direction or area."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from difflib import SequenceMatcher
from math import degrees, sqrt

import numpy as np

from geometry.errors import InputError, SelectorError
from geometry.part import MILLIMETRES_PER_METRE, FaceRegion, Shape
from geometry.solid import face_region

#: A face looks along a direction if its normal strays from it by less [degree].
ALONG = 1.0
#: How far a face without the wanted colour, or one that is not plane, is from what is wanted, beside one that looks the
#: opposite way [-].
QUITE = 1.0
#: A face is at a place if it is this near to it [mm].
AT = 1e-3
#: Faces that a refusal lists.
LISTED = 12


@dataclass(frozen=True, kw_only=True)
class FaceSelector:
    """Criteria of faces: a face must meet all that are given.

    Parameters
    ----------
    name
        Name of the face in the file.
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
        return not any(self.misfits(selector))

    def misfits(self, selector: FaceSelector) -> Iterator[tuple[float, str]]:
        """Distances of the face from the criteria that it does not meet [-], and its values, in words."""
        if selector.name is not None and self.name != selector.name:
            alike = SequenceMatcher(a=self.name.lower(), b=selector.name.lower()).ratio()
            yield 1 - alike, f'its name is "{self.name}"' if self.name else "it has no name"
        if selector.colour is not None and self.colour.upper() != selector.colour.upper():
            yield QUITE, f"its colour is {self.colour}" if self.colour else "it has no colour"
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
            yield QUITE, "it is not plane"
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
    """Regions by name, each of all faces that one of its selectors means.

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
        A selector that no face fits, with the nearest and the faces there are; or a face in two regions.
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
    """The face that misses the fewest things, and those by the least, with what to give for it."""
    missed = [list(face.misfits(selector)) for face in known]
    best = min(range(len(known)), key=lambda k: (len(missed[k]), sum(far for far, _ in missed[k])))
    clauses = " and ".join(words for _, words in missed[best])
    return f"the nearest is the {known[best]}, but {clauses}: give the properties of the intended face"
