"""Bi-conical damper of the rig: a cylinder between two cones, which rest in the grooves of blade and de-coupler."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import partial
from math import pi, radians, sqrt, tan

import numpy as np

from geometry.dimension import SMALLEST, check_dimensions, in_millimetres
from geometry.interface import N_STATION, ContactLine, straight_contact_line
from geometry.part import Part, Point

#: Body on which each side of a damper rests, and sign of y of the side.
SIDES = (("blade", -1.0), ("decoupler", 1.0))


@dataclass(frozen=True, kw_only=True)
class Damper:
    """Dimensions of a damper [m; rad where noted].

    Local axes: y along the axis of the damper, from the blade to the de-coupler; z up, to the crests that it touches;
    the origin in its middle. It is a body of revolution, symmetric about y = 0.

    The paper publishes only the half-angle of the cones. The other dimensions are chosen here, so that a damper weighs
    about 27 g and fits the blade's groove with seven stations 2 mm apart.

    Parameters
    ----------
    radius
        Radius of the cylinder in the middle, where the wire of the dead weight pulls.
    cylinder_length
        Length between the cones: twice the radius, which leaves room for the wire.
    contact_length
        Length of a contact line, measured along the axis from the end of a cone.
    shoulder
        Length of a cone between its contact line and the cylinder, so that pads do not touch the edge of the cylinder.
    cone_half_angle
        Half-angle of the cones: the published 8.53 degrees, a taper of 15 % [rad].

    Raises
    ------
    GeometryError
        Dimensions out of range or in conflict; the message lists all with values and remedy.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), sections 2.1 and 2.2.
    """

    radius: float = 0.006
    cylinder_length: float = 0.012
    contact_length: float = 0.012
    shoulder: float = 0.001
    cone_half_angle: float = radians(8.53)

    def __post_init__(self) -> None:
        check_dimensions("damper", self, at_most=[("shoulder", "contact_length")], further=self._shape_problems)

    def _shape_problems(self, invalid: Collection[str]) -> Iterator[str]:
        if not invalid and self.end_radius < SMALLEST:
            yield (
                f"contact_length = {in_millimetres(self.contact_length)} is longer than the cones, which taper to a "
                f"point from radius = {in_millimetres(self.radius)}: shorten it or raise the radius"
            )

    @property
    def cone_length(self) -> float:
        """Length of each cone along the axis: shoulder and contact [m]."""
        return self.shoulder + self.contact_length

    @property
    def half_length(self) -> float:
        """Distance |y| of the ends from the middle [m]."""
        return self.cylinder_length / 2 + self.cone_length

    @property
    def end_radius(self) -> float:
        """Radius of the ends, where contact starts [m]."""
        return self.radius - self.cone_length * tan(self.cone_half_angle)

    @property
    def wide_radius(self) -> float:
        """Radius of the cones where contact ends, at the shoulder [m]."""
        return self.radius - self.shoulder * tan(self.cone_half_angle)

    @property
    def volume(self) -> float:
        """Volume of cylinder and cones, in closed form [m^3]."""
        r, e = self.radius, self.end_radius
        return pi * (r**2 * self.cylinder_length + 2 * self.cone_length * (r**2 + r * e + e**2) / 3)


def contact_lines(damper: Damper, n_station: int = N_STATION) -> dict[str, ContactLine]:
    """Contact lines along the crests of the two cones, from the ends of the damper to the shoulders.

    The normal points out of the damper, into the crest of the groove. The first tangent points along the line, to the
    middle of the damper; the second along x.

    Parameters
    ----------
    damper
        Dimensions of the damper.
    n_station
        Number of evenly spaced stations on each line, ends included [-].

    Returns
    -------
    The lines "contact_blade" (at -y) and "contact_decoupler" (at +y).

    Raises
    ------
    GeometryError
        Fewer than two stations.
    """
    slope, shoulder = tan(damper.cone_half_angle), damper.cylinder_length / 2 + damper.shoulder
    return {
        f"contact_{body}": straight_contact_line(
            name=f"contact_{body}",
            start=np.array([0.0, side * damper.half_length, damper.end_radius]),
            end=np.array([0.0, side * shoulder, damper.wide_radius]),
            normal=np.array([0.0, side * slope, 1.0]) / sqrt(1 + slope**2),
            across=np.array([1.0, 0.0, 0.0]),
            n_station=n_station,
        )
        for body, side in SIDES
    }


def named_points(damper: Damper) -> dict[str, Point]:
    """Named points of a damper.

    Returns
    -------
    "dead_weight", where the wire under the middle of the cylinder pulls it up into the grooves; "laser_blade" and
    "laser_decoupler", where the differential laser measures the damper beside the pads, on the side of +x [m].
    """
    result = {"dead_weight": np.array([0.0, 0.0, -damper.radius])}
    for body, side in SIDES:
        result[f"laser_{body}"] = np.array([damper.radius, side * damper.cylinder_length / 2, 0.0])
    return result


def damper_part(damper: Damper) -> Part:
    """Build the damper as one solid with named faces, points and contact lines.

    Its seams are the generators on top (+z): edges of the CAD model on which the contact lines lie.

    Returns
    -------
    Part with the faces "cone_blade", "cone_decoupler", "cylinder", "end_blade" and "end_decoupler".

    Raises
    ------
    GeometryError
        The dimensions give no single valid solid.
    """
    from geometry.solid import curved_faces, face_region, plane_faces, single_solid, turned_about_y

    middle, end = damper.cylinder_length / 2, damper.half_length
    outline = [(-end, damper.end_radius), (-middle, damper.radius), (middle, damper.radius), (end, damper.end_radius)]
    solid = single_solid("damper", turned_about_y(outline))
    result = {"cylinder": curved_faces(solid, where=lambda centre: abs(centre[1]) < middle)}
    for body, side in SIDES:
        result[f"cone_{body}"] = curved_faces(solid, where=partial(_is_beyond, side, middle))
        result[f"end_{body}"] = plane_faces(solid, normal=(0, int(side), 0), offset=end)
    faces = {name: face_region(name, region) for name, region in result.items()}
    return Part(
        name="damper", solid=solid, faces=faces, points=named_points(damper), contact_lines=contact_lines(damper)
    )


def _is_beyond(side: float, middle: float, centre: Point) -> bool:
    """Whether the centre of a face lies beyond the cylinder on one side."""
    return bool(side * centre[1] > middle)
