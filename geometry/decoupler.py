"""L-shaped de-coupler of the rig: a grooved pad on a plate, and two arms at right angles that end in load cells."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import partial
from math import cos, degrees, radians, sin, sqrt, tan

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.dimension import CONE, SMALLEST, check_dimensions, in_millimetres
from geometry.groove import groove_problems
from geometry.interface import N_STATION, ContactLine, straight_contact_line
from geometry.part import Part, Point

Lengths = Float[NDArray[np.float64], "*k"]

# Pairs of dimensions of which the first must not exceed the second: a neck is not thicker than its arm, an arm not
# thicker than its load cell, and the arms meet on the contact line.
AT_MOST = (("neck_thickness", "arm_thickness"), ("arm_thickness", "cell_thickness"), ("arms_meet", "contact_length"))
# Range of the arm angle [rad]; outside it the arms are nearly parallel or perpendicular to the damper, and two load
# cells cannot separate its two forces.
ARM = {"arm_angle": (radians(20.0), radians(70.0))}


@dataclass(frozen=True, kw_only=True)
class Decoupler:
    """Dimensions of a de-coupler [m; rad where noted].

    Local axes: x as for the blade; y along the groove, away from the damper; z up, from the axis of the groove; y = 0
    at the face of the pad towards the blade. It is symmetric about x = 0.

    The pad mirrors that of the blade. It is on a plate, from whose back two arms rise and fall at the same angle. A
    flexible neck near the root of each arm makes it bend easily, so that the arm transmits only the force along its
    axis. The axes of the arms meet on the contact line: a force in the middle of the line then causes no moment and no
    transverse force in the arms. The load cells belong to the body; their far ends are fixed.

    The paper publishes only the angle of the arms; the other dimensions are chosen here.

    Parameters
    ----------
    width
        Width along x of all parts, equal to that of the blade's pads.
    contact_length
        Length of the contact line, measured along the axis from the face of the pad.
    end_clearance
        Distance between the end of the damper and the plate.
    groove_radius
        Radius of the groove where contact starts, at the end of the damper.
    lip_above_axis
        Height of the pad's lower face above the groove's axis; positive, so that the groove has no undercut.
    pad_height_above_groove
        Height of the pad above the widest crest of the groove.
    plate_thickness
        Thickness of the plate along y; its height is that of the roots of the arms.
    arm_angle
        Angle of each arm to the plane of the damper's axis: the published 45 degrees [rad].
    arms_meet
        Position y, behind the face of the pad, where the axes of the arms meet at the height of the contact line.
    arm_thickness, stub_length, arm_length
        Thickness of the arms in the plane of symmetry; length of the stub between the plate and the neck, along its
        outer face, and of the arm between neck and load cell.
    neck_thickness, neck_length
        Thickness and length of the flexible necks.
    cell_thickness, cell_length
        Thickness and length of the load cells.
    cone_half_angle
        Half-angle of the groove [rad]: the damper's 8.53 degrees.

    Raises
    ------
    GeometryError
        Dimensions out of range or in conflict; the message lists all with values and remedy.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), sections 2.1 and 2.2.
    """

    width: float = 0.022
    contact_length: float = 0.012
    end_clearance: float = 0.002
    groove_radius: float = 0.00605
    lip_above_axis: float = 0.003
    pad_height_above_groove: float = 0.007
    plate_thickness: float = 0.006
    arm_angle: float = radians(45.0)
    arms_meet: float = 0.006
    arm_thickness: float = 0.010
    stub_length: float = 0.004
    arm_length: float = 0.036
    neck_thickness: float = 0.003
    neck_length: float = 0.008
    cell_thickness: float = 0.018
    cell_length: float = 0.020
    cone_half_angle: float = radians(8.53)

    def __post_init__(self) -> None:
        further = partial(_shape_problems, self)
        check_dimensions("de-coupler", self, at_most=AT_MOST, angles=CONE | ARM, further=further)

    def groove_radius_at(self, y: Lengths) -> Lengths:
        """Radius of the conical groove, which narrows towards the plate [m]."""
        return self.groove_radius + (self.contact_length - y) * tan(self.cone_half_angle)

    @property
    def wide_groove_radius(self) -> float:
        """Radius of the groove at the face of the pad [m]."""
        return self.groove_radius + self.contact_length * tan(self.cone_half_angle)

    @property
    def narrow_groove_radius(self) -> float:
        """Radius of the groove at the plate [m]."""
        return self.groove_radius - self.end_clearance * tan(self.cone_half_angle)

    @property
    def plate_front(self) -> float:
        """Position y of the front face of the plate, with the pad [m]."""
        return self.contact_length + self.end_clearance

    @property
    def plate_back(self) -> float:
        """Position y of the back face of the plate, with the arms [m]."""
        return self.plate_front + self.plate_thickness

    @property
    def top(self) -> float:
        """Height z of the pad's upper face [m]."""
        return self.wide_groove_radius + self.pad_height_above_groove

    @property
    def middle(self) -> float:
        """Height z at which the axes of the arms meet; plate and arms are symmetric about it [m]."""
        return float(self.groove_radius_at(np.array(self.arms_meet)))

    @property
    def arms_reach(self) -> float:
        """Distance along y from the point where the axes of the arms meet to the plate's back [m]."""
        return self.plate_back - self.arms_meet

    @property
    def half_height(self) -> float:
        """Half the height of the plate, which ends at the outer faces of the arms [m]."""
        return self.arms_reach * tan(self.arm_angle) + self.arm_thickness / 2 / cos(self.arm_angle)

    @property
    def plate_bottom(self) -> float:
        """Height z of the plate's lower face [m]."""
        return self.middle - self.half_height

    @property
    def plate_top(self) -> float:
        """Height z of the plate's upper face [m]."""
        return self.middle + self.half_height


@dataclass(frozen=True, kw_only=True)
class Arm:
    """Position of the upper arm in the plane of symmetry, relative to the middle of the plate's back; see `arm`.

    Parameters
    ----------
    along, across
        Unit vectors (y, z) along the arm, to the load cell, and perpendicular to it, outwards [-].
    centre
        Offset of the arm's centre line along `across` [m].
    stations
        Distances along the arm of the start of neck, arm and load cell, and of the load cell's end [m].
    """

    along: tuple[float, float]
    across: tuple[float, float]
    centre: float
    stations: tuple[float, ...]

    def point(self, along: Lengths, offset: Lengths) -> tuple[Lengths, Lengths]:
        """Points (y, z) relative to the middle of the plate's back, at distances along and off the centre line [m]."""
        off = self.centre + offset
        return along * self.along[0] + off * self.across[0], along * self.along[1] + off * self.across[1]


def arm(decoupler: Decoupler) -> Arm:
    """Upper arm, whose outer face starts at the plate's upper back edge; the lower arm is its mirror image."""
    angle = decoupler.arm_angle
    lengths = (decoupler.stub_length, decoupler.neck_length, decoupler.arm_length, decoupler.cell_length)
    stations = decoupler.half_height * sin(angle) + np.cumsum(lengths)
    return Arm(
        along=(cos(angle), sin(angle)),
        across=(-sin(angle), cos(angle)),
        centre=decoupler.arms_reach * sin(angle),
        stations=tuple(float(item) for item in stations),
    )


def make_outline(decoupler: Decoupler) -> list[tuple[float, float]]:
    """Corners (y, z) of the outline of plate, arms and load cells in the plane of symmetry [m]."""
    one = arm(decoupler)
    neck, beam, cell, end = one.stations
    thick, thin, wide = decoupler.arm_thickness, decoupler.neck_thickness, decoupler.cell_thickness
    along = np.array([neck, neck, beam, beam, cell, cell, end])
    half_width = np.array([thick, thin, thin, thick, thick, wide, wide]) / 2
    outer, inner = np.stack(one.point(along, half_width), axis=1), np.stack(one.point(along, -half_width), axis=1)
    front = [[-decoupler.plate_thickness, decoupler.half_height], [0.0, decoupler.half_height]]
    upper = np.concatenate([front, outer, inner[::-1]])
    lower = upper[::-1] * [1.0, -1.0]
    # Behind the plate both stubs start from a common edge, at half its height.
    corners = np.concatenate([upper, [[0.0, 0.0]], lower])
    corners += np.array([decoupler.plate_back, decoupler.middle])
    return [(float(y), float(z)) for y, z in corners]


def contact_lines(decoupler: Decoupler, n_station: int = N_STATION) -> dict[str, ContactLine]:
    """Contact line along the crest of the groove, from the damper's end to the face of the pad.

    The normal points out of the de-coupler, into the groove. The first tangent points along the line, towards the
    blade; the second along x.

    Parameters
    ----------
    decoupler
        Dimensions of the de-coupler.
    n_station
        Number of evenly spaced stations on the line, ends included [-].

    Returns
    -------
    The line "contact".

    Raises
    ------
    GeometryError
        Fewer than two stations.
    """
    slope = tan(decoupler.cone_half_angle)
    line = straight_contact_line(
        name="contact",
        start=np.array([0.0, decoupler.contact_length, decoupler.groove_radius]),
        end=np.array([0.0, 0.0, decoupler.wide_groove_radius]),
        normal=np.array([0.0, -slope, -1.0]) / sqrt(1 + slope**2),
        across=np.array([1.0, 0.0, 0.0]),
        n_station=n_station,
    )
    return {line.name: line}


def named_points(decoupler: Decoupler) -> dict[str, Point]:
    """Named points of a de-coupler.

    Returns
    -------
    "cell_upper" and "cell_lower", the middles of the fixed ends of the load cells; "laser", the lower edge of the pad
    beside the damper, on the side of +x [m].
    """
    one = arm(decoupler)
    y, z = (float(item) for item in one.point(np.array(one.stations[-1]), np.array(0.0)))
    result = {
        f"cell_{name}": np.array([0.0, decoupler.plate_back + y, decoupler.middle + side * z])
        for name, side in (("upper", 1.0), ("lower", -1.0))
    }
    return {**result, "laser": np.array([decoupler.width / 2, 0.0, decoupler.lip_above_axis])}


def decoupler_part(decoupler: Decoupler) -> Part:
    """Build the de-coupler as one solid with named faces, points and its contact line.

    Returns
    -------
    Part with the faces "groove" (only the cone), "pad" (the face towards the blade), "cell_upper" and "cell_lower" (the
    fixed ends of the load cells).

    Raises
    ------
    GeometryError
        The dimensions give no single valid solid.
    """
    from geometry import solid as cad

    half = decoupler.width / 2
    pad = cad.block((-half, 0.0, decoupler.lip_above_axis), (half, decoupler.plate_front, decoupler.top))
    # The cutter extends beyond the pad, so that no faces of the two coincide where the groove is open.
    before = -decoupler.contact_length / 10
    cutter = cad.cone_along_y(
        start=before,
        end=decoupler.plate_front,
        start_radius=float(decoupler.groove_radius_at(np.array(before))),
        end_radius=decoupler.narrow_groove_radius,
        axis_height=0.0,
    )
    # Not simplified after the union: merging faces would remove the crest of the groove, which is an edge.
    solid = cad.single_solid("de-coupler", cad.plate(make_outline(decoupler), -half, half).fuse(pad.cut(cutter)))
    points = named_points(decoupler)
    result = {
        "groove": cad.curved_faces(solid, where=lambda _: True),
        "pad": cad.plane_faces(solid, normal=(0, -1, 0), offset=0.0),
        "cell_upper": cad.faces_at(solid, points["cell_upper"]),
        "cell_lower": cad.faces_at(solid, points["cell_lower"]),
    }
    return Part(
        name="decoupler",
        solid=solid,
        faces={name: cad.face_region(name, faces) for name, faces in result.items()},
        points=points,
        contact_lines=contact_lines(decoupler),
    )


def _shape_problems(decoupler: Decoupler, invalid: Collection[str]) -> Iterator[str]:
    """Conflicts of valid dimensions because of which groove, plate and arms are not one body."""
    if invalid:
        return
    yield from groove_problems(
        lip_above_axis=decoupler.lip_above_axis,
        narrow_radius=decoupler.narrow_groove_radius,
        wide_radius=decoupler.wide_groove_radius,
        width=decoupler.width,
        width_name="width",
        narrow_at="the plate",
        sides="the sides of the pad",
    )
    thickest = 2 * decoupler.arms_reach * sin(decoupler.arm_angle)
    if decoupler.arm_thickness > thickest:
        yield (
            f"arm_thickness = {in_millimetres(decoupler.arm_thickness)} makes the arms overlap behind the plate (give "
            f"{in_millimetres(thickest)} at most, or a thicker plate)"
        )
    if decoupler.plate_top < decoupler.top + SMALLEST:
        yield (
            f"pad_height_above_groove = {in_millimetres(decoupler.pad_height_above_groove)} lifts the pad above the "
            f"plate, whose height the arms give (lower it by "
            f"{in_millimetres(decoupler.top + SMALLEST - decoupler.plate_top)} or thicken the plate)"
        )
    if decoupler.plate_bottom > decoupler.lip_above_axis - SMALLEST:
        yield (
            f"arm_angle = {degrees(decoupler.arm_angle):.6g} deg makes the plate end above the lower face of the pad "
            "(give more, or a thicker plate)"
        )
    one = arm(decoupler)
    _, height = one.point(np.array(one.stations[2]), np.array(-decoupler.cell_thickness / 2))
    if height < SMALLEST:
        yield (
            f"cell_thickness = {in_millimetres(decoupler.cell_thickness)} makes the two load cells touch (lower it or "
            "lengthen the arms)"
        )
