"""Rig: a blade between two dampers, each of which rests in a groove of the blade and in a groove of a de-coupler."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import degrees, tan

import numpy as np

from geometry import blade as blade_geometry
from geometry import damper as damper_geometry
from geometry import decoupler as decoupler_geometry
from geometry.blade import Blade
from geometry.blade_solid import blade_part
from geometry.damper import Damper
from geometry.decoupler import Decoupler
from geometry.dimension import SMALLEST, in_millimetres, refuse
from geometry.interface import ContactLine
from geometry.part import Part, Point
from geometry.placement import Placement

# Largest distance between two mating lines [m], the grinding tolerance of such rigs.
MATING = 1e-6
#: Sign of y of each side of the rig, and name of the blade's contact line there.
SIDES = {"left": (-1.0, "contact_negative"), "right": (1.0, "contact_positive")}


@dataclass(frozen=True, kw_only=True)
class Rig:
    """Five bodies, symmetric about y = 0; axes are those of the blade.

    Parameters
    ----------
    blade, damper, decoupler
        Dimensions of the bodies, equal on both sides.
    excitation_radius
        Radius of the disc on the blade's flat face on which the shaker acts; the foot of a force sensor is at least
        10 mm wide [m].

    Raises
    ------
    GeometryError
        Dimensions with which the bodies do not touch only along their lines; the message lists all with values and
        remedy.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 2.1.
    """

    blade: Blade = field(default_factory=Blade)
    damper: Damper = field(default_factory=Damper)
    decoupler: Decoupler = field(default_factory=Decoupler)
    excitation_radius: float = 0.005

    def __post_init__(self) -> None:
        mating = [*_mating_problems(self, "blade", self.blade), *_mating_problems(self, "decoupler", self.decoupler)]
        refuse("rig", [*_excitation_problems(self), *mating])

    @property
    def damper_axis(self) -> float:
        """Height z of the dampers' axes, at which the crests of cone and groove coincide [m]."""
        return self.blade.groove_axis + self.blade.groove_radius - self.damper.end_radius

    @property
    def decoupler_axis(self) -> float:
        """Height z of the axes of the de-couplers' grooves [m]."""
        return self.damper_axis + self.damper.end_radius - self.decoupler.groove_radius

    @property
    def damper_middle(self) -> float:
        """Distance |y| of the middles of the dampers [m]."""
        return self.blade.contact_start + self.damper.half_length

    @property
    def decoupler_face(self) -> float:
        """Distance |y| of the faces of the de-couplers' pads towards the blade [m]."""
        return self.damper_middle + self.damper.half_length - self.decoupler.contact_length


@dataclass(frozen=True, kw_only=True, eq=False)
class MatingPair:
    """Pair of contact lines that coincide station by station.

    Parameters
    ----------
    name
        Side, and body that the damper touches, such as "left_blade".
    damper, other
        Names of the two bodies.
    damper_line, other_line
        Contact lines in the rig's axes, with the same stations in the same order.
    """

    name: str
    damper: str
    other: str
    damper_line: ContactLine
    other_line: ContactLine


def placements(rig: Rig) -> dict[str, Placement]:
    """Placements of the five bodies by name: "blade", and a "damper_..." and a "decoupler_..." for each side."""
    result = {"blade": Placement()}
    for side, (sign, _) in SIDES.items():
        middle = np.array([0.0, sign * rig.damper_middle, rig.damper_axis])
        face = np.array([0.0, sign * rig.decoupler_face, rig.decoupler_axis])
        result[f"damper_{side}"] = Placement(mirrored=sign < 0, shift=middle)
        result[f"decoupler_{side}"] = Placement(mirrored=sign < 0, shift=face)
    return result


def mating_pairs(rig: Rig) -> dict[str, MatingPair]:
    """Four pairs of contact lines by name: "left_blade", "left_decoupler", "right_blade" and "right_decoupler".

    Stations are evenly spaced on each line, ends included.
    """
    blade = blade_geometry.contact_lines(rig.blade)
    damper = damper_geometry.contact_lines(rig.damper)
    (groove,) = decoupler_geometry.contact_lines(rig.decoupler).values()
    place = placements(rig)
    result = {}
    for side, (_, blade_line) in SIDES.items():
        lies = place[f"damper_{side}"]
        for other, line in (("blade", blade[blade_line]), ("decoupler", place[f"decoupler_{side}"].line(groove))):
            result[f"{side}_{other}"] = MatingPair(
                name=f"{side}_{other}",
                damper=f"damper_{side}",
                other="blade" if other == "blade" else f"decoupler_{side}",
                damper_line=lies.line(damper[f"contact_{other}"]),
                other_line=line,
            )
    return result


def named_points(rig: Rig) -> dict[str, dict[str, Point]]:
    """Named points by body and name, in the rig's axes [m].

    The blade has two additional points, "laser_left" and "laser_right": the lower edges of its pads beside the dampers,
    on the side of +x, which the differential laser compares with the dampers' "laser_blade".
    """
    blade, place = rig.blade, placements(rig)
    result = {"blade": dict(blade_geometry.named_points(blade))}
    for side, (sign, _) in SIDES.items():
        result["blade"][f"laser_{side}"] = np.array([blade.flat_width / 2, sign * blade.pad_face, blade.pad_bottom])
        own = {
            f"damper_{side}": damper_geometry.named_points(rig.damper),
            f"decoupler_{side}": decoupler_geometry.named_points(rig.decoupler),
        }
        result |= {body: {name: place[body].points(point) for name, point in one.items()} for body, one in own.items()}
    return result


def rig_parts(rig: Rig) -> dict[str, Part]:
    """Build the five bodies in CAD, placed in the rig, by name.

    Raises
    ------
    GeometryError
        The dimensions of a body give no single valid solid.
    """
    own = {
        "blade": blade_part(rig.blade),
        "damper": damper_geometry.damper_part(rig.damper),
        "decoupler": decoupler_geometry.decoupler_part(rig.decoupler),
    }
    return {name: place.part(own[name.partition("_")[0]], name) for name, place in placements(rig).items()}


def _excitation_problems(rig: Rig) -> Iterator[str]:
    """Problems of the excitation disc, which must lie on the blade's flat face between root and pads."""
    blade = rig.blade
    height, width = blade.excitation_height, blade.flat_width / 2
    most = min(width, height, blade.pad_bottom - height)
    if not SMALLEST <= rig.excitation_radius <= most:
        yield (
            f"excitation_radius = {in_millimetres(rig.excitation_radius)} is not between {in_millimetres(SMALLEST)} "
            f"and {in_millimetres(most)}, the extent of the flat face of the blade about excitation_height = "
            f"{in_millimetres(height)} (give a smaller excitation_radius, or move the disc)"
        )


def _mating_problems(rig: Rig, name: str, body: Blade | Decoupler) -> Iterator[str]:
    """Problems of a groove and a damper's cone, which must touch along exactly one line."""
    damper = rig.damper
    apart = abs(body.contact_length - damper.contact_length)
    if apart > MATING:
        yield (
            f"contact_length = {in_millimetres(damper.contact_length)} of the damper is not that of the {name}, "
            f"{in_millimetres(body.contact_length)} (give all bodies the same)"
        )
    parting = abs(tan(damper.cone_half_angle) - tan(body.cone_half_angle)) * damper.contact_length
    if parting > MATING:
        yield (
            f"cone_half_angle = {degrees(damper.cone_half_angle):.6g} deg of the damper is not that of the {name}, "
            f"{degrees(body.cone_half_angle):.6g} deg, so that they separate by {1e6 * parting:.3g} um along the line "
            "(give all bodies the same)"
        )
    if body.groove_radius <= damper.end_radius + MATING:
        yield (
            f"groove_radius = {in_millimetres(body.groove_radius)} of the {name} is too narrow for the damper end, "
            f"whose radius is {in_millimetres(damper.end_radius)}: they would touch around the whole circumference or "
            "overlap (widen the groove)"
        )
