"""Blade of the rig: a slender plate with bevelled edges on a root block, and a grooved pad on each face at mid-span."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import partial
from math import radians, sqrt, tan

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.blade_points import named_points as named_points
from geometry.dimension import SMALLEST, check_dimensions, in_millimetres
from geometry.groove import groove_problems
from geometry.interface import N_STATION, ContactLine, straight_contact_line

# Pairs of dimensions of which the first must not exceed the second: bevels make the edges thinner, the pads are on the
# flat, and the blade is inside its root block.
AT_MOST = (
    ("edge_thickness", "thickness"),
    ("flat_width", "chord"),
    ("chord", "root_chord"),
    ("thickness", "root_thickness"),
)


@dataclass(frozen=True, kw_only=True)
class Blade:
    """Dimensions of the rig's blade [m; rad where noted].

    Axes: x chord, y thickness (the direction of vibration), z span; z = 0 where the blade leaves its root block.
    It is symmetric about x = 0 and y = 0. Each flat face has a pad with a conical groove, open downwards, for the end
    of a bi-conical damper along y.

    The paper publishes no dimension of the rig except the angle of the damper's cone, and the measured first frequency.
    The dimensions are chosen here so that the dynamics agree (122.25 Hz, second mode above twice the first).
    `docs/blade.md` has a drawing.

    Parameters
    ----------
    length
        Length from root block to tip. It was searched, together with the thickness of the root block, so that the mesh
        study of Table 1 is reproduced; it is many times the thickness, so that the first modes are those of a slender
        beam.
    thickness
        Thickness of the flat middle. With the length it determines the first frequency (proportional to thickness /
        length^2); it was chosen for the measured frequency before the length was searched.
    edge_thickness
        Thickness at the two long edges: blades are thinner at their edges, and bevels have exact areas and volumes.
    chord
        Width: four thicknesses, so that edgewise bending is about four times as high as the first mode, and the second
        mode above twice the first.
    flat_width
        Width of the flat middle and of the pads on it: the widest mouth of the groove and a solid lip on each side.
    root_chord, root_thickness, root_height
        Dimensions of the root block: larger than the section, so that the blade is inside it and the block's two faces
        normal to y can be clamped. The thickness was searched, together with the length, so that the mesh study of
        Table 1 is reproduced; the height is three times the blade's thickness.
    contact_height
        Height z of the middle of a contact line: at mid-span, where the first mode has about a third of its amplitude
        at the tip: enough for slip of a damper, and not enough for the mass of the pads to determine the frequency.
    contact_length
        Length of a contact line, measured along y: seven stations 2 mm apart, so that each is a corner node of 1 mm or
        2 mm elements.
    pad_clearance
        Distance between the blade's face and the inner end of a damper, which must not touch it; contact starts there.
    pad_height_above_groove
        Height of the pad above the deepest crest of the groove: the pad must be stiff compared with the contact.
    lip_above_axis
        Height of the pad's lower face above the groove's axis. It is positive, so that the groove has no undercut: the
        damper is inserted from below and held only by its load.
    groove_radius
        Radius of the groove where contact starts. The damper's cone has 4.05 mm there (radius 6 mm, 15 % taper over 13
        mm); the groove has 2 mm more, and its axis is 2 mm lower: cones of equal angle with parallel axes touch only
        along one straight line, the crest.
    cone_half_angle
        Half-angle of the groove [rad]: the damper's published 8.53 degrees, a taper of 15 %.
    excitation_height
        Height z of the point where the stinger of the shaker acts: near the root, where the blade moves least and is
        least affected by the shaker, and below the pads.

    Raises
    ------
    GeometryError
        Dimensions out of range or in conflict; the message lists all with values and remedy.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), sections 2.1 to 2.3 and Table 1.
    """

    length: float = 0.2504
    thickness: float = 0.01004
    edge_thickness: float = 0.006
    chord: float = 0.040
    flat_width: float = 0.022
    root_chord: float = 0.060
    root_thickness: float = 0.016
    root_height: float = 0.030
    contact_height: float = 0.125
    contact_length: float = 0.012
    pad_clearance: float = 0.002
    pad_height_above_groove: float = 0.007
    lip_above_axis: float = 0.003
    groove_radius: float = 0.00605
    cone_half_angle: float = radians(8.53)
    excitation_height: float = 0.020

    def __post_init__(self) -> None:
        check_dimensions("blade", self, at_most=AT_MOST, further=partial(_pad_problems, self))

    def groove_radius_at(self, y: Float[NDArray[np.float64], "*k"]) -> Float[NDArray[np.float64], "*k"]:
        """Radius of the conical groove at a distance |y| from the mid-plane [m]."""
        return self.groove_radius + (np.abs(y) - self.contact_start) * tan(self.cone_half_angle)

    @property
    def contact_start(self) -> float:
        """Distance |y| of the inner end of a contact line: blade face plus clearance [m]."""
        return self.thickness / 2 + self.pad_clearance

    @property
    def pad_face(self) -> float:
        """Distance |y| of the outer face of a pad, where the contact line ends [m]."""
        return self.contact_start + self.contact_length

    @property
    def groove_axis(self) -> float:
        """Height z of the axis of the groove; its crest is at `contact_height` in the middle of the line [m]."""
        return self.contact_height - self.groove_radius - 0.5 * self.contact_length * tan(self.cone_half_angle)

    @property
    def narrow_groove_radius(self) -> float:
        """Radius of the groove where it meets the blade's face, its narrow end [m]."""
        return self.groove_radius - self.pad_clearance * tan(self.cone_half_angle)

    @property
    def wide_groove_radius(self) -> float:
        """Radius of the groove at the pad's outer face, its wide end [m]."""
        return self.groove_radius + self.contact_length * tan(self.cone_half_angle)

    @property
    def pad_bottom(self) -> float:
        """Height z of the lips of the groove [m]."""
        return self.groove_axis + self.lip_above_axis

    @property
    def pad_top(self) -> float:
        """Height z of the upper face of a pad [m]."""
        return self.groove_axis + self.wide_groove_radius + self.pad_height_above_groove


def contact_lines(blade: Blade, n_station: int = N_STATION) -> dict[str, ContactLine]:
    """Contact lines along the crests of the two grooves, from the inner end of the damper to the face of the pad.

    The normal points out of the blade, into the groove. The first tangent points away from the blade, the second along
    x. The lines are mirror images at y = 0, so that their frames (normal, tangents) have opposite handedness.

    Parameters
    ----------
    blade
        Dimensions of the blade.
    n_station
        Number of evenly spaced stations on each line, ends included [-].

    Returns
    -------
    The lines "contact_positive" (on the pad at +y) and "contact_negative".

    Raises
    ------
    GeometryError
        Fewer than two stations.
    """
    slope = tan(blade.cone_half_angle)
    crest = blade.groove_axis + np.array([blade.groove_radius, blade.wide_groove_radius])
    lines = {}
    for side, name in ((1.0, "contact_positive"), (-1.0, "contact_negative")):
        lines[name] = straight_contact_line(
            name=name,
            start=np.array([0.0, side * blade.contact_start, crest[0]]),
            end=np.array([0.0, side * blade.pad_face, crest[1]]),
            normal=np.array([0.0, side * slope, -1.0]) / sqrt(1 + slope**2),
            across=np.array([1.0, 0.0, 0.0]),
            n_station=n_station,
        )
    return lines


def _pad_problems(blade: Blade, invalid: Collection[str]) -> Iterator[str]:
    """Conflicts of valid dimensions because of which pads and grooves cannot be built on the blade."""
    if invalid:
        return
    low, high = in_millimetres(blade.pad_bottom), in_millimetres(blade.pad_top)
    height = f"contact_height = {in_millimetres(blade.contact_height)}"
    if blade.pad_bottom < SMALLEST:
        yield f"{height} puts the lower face of the pads at {low}, into the root block (raise it)"
    if blade.pad_top > blade.length - SMALLEST:
        yield (
            f"{height} puts the upper face of the pads at {high}, not below the tip at length = "
            f"{in_millimetres(blade.length)} (lower it)"
        )
    yield from groove_problems(
        lip_above_axis=blade.lip_above_axis,
        narrow_radius=blade.narrow_groove_radius,
        wide_radius=blade.wide_groove_radius,
        width=blade.flat_width,
        width_name="flat_width",
        narrow_at="the blade's face",
        sides="the sides of the pads",
    )
    if blade.excitation_height > blade.pad_bottom - SMALLEST:
        yield (
            f"excitation_height = {in_millimetres(blade.excitation_height)} is not below the pads, which start at "
            f"{low} (lower it)"
        )
