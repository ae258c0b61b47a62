"""The rig's blade: a slender tapered-edge plate on a root block, with a grooved pad on each face at mid-span."""

from dataclasses import dataclass
from math import radians, tan

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Blade:
    """Dimensions of the rig's blade [m, rad where said].

    Axes: x chord, y thickness (the direction of vibration), z span; z = 0 where the blade leaves its root block.
    The paper publishes no dimensions: these are ours, chosen so that the physics matches.
    """

    length: float = 0.250
    thickness: float = 0.01004
    edge_thickness: float = 0.006
    chord: float = 0.040
    flat_width: float = 0.022
    root_chord: float = 0.060
    root_thickness: float = 0.040
    root_height: float = 0.030
    contact_height: float = 0.125
    contact_length: float = 0.012
    pad_clearance: float = 0.002
    pad_height_above_groove: float = 0.007
    lip_above_axis: float = 0.003
    groove_radius: float = 0.00605
    cone_half_angle: float = radians(8.53)

    def groove_radius_at(self, y: Float[NDArray[np.float64], " k"]) -> Float[NDArray[np.float64], " k"]:
        """Radius of the conical groove at a distance |y| from the mid-plane [m]."""
        return self.groove_radius + (np.abs(y) - self.contact_start) * tan(self.cone_half_angle)

    @property
    def contact_start(self) -> float:
        """|y| of the inner end of a contact line: blade face plus clearance [m]."""
        return self.thickness / 2 + self.pad_clearance

    @property
    def pad_face(self) -> float:
        """|y| of the outer face of a pad, where the contact line ends [m]."""
        return self.contact_start + self.contact_length

    @property
    def groove_axis(self) -> float:
        """Height z of the axis of the conical groove: its crest is at `contact_height` half-way along the line [m]."""
        return self.contact_height - self.groove_radius - 0.5 * self.contact_length * tan(self.cone_half_angle)

    @property
    def pad_bottom(self) -> float:
        """Height z of the lips of the groove [m]."""
        return self.groove_axis + self.lip_above_axis

    @property
    def pad_top(self) -> float:
        """Height z of the upper face of a pad [m]."""
        return self.groove_axis + self.groove_radius + self.contact_length * tan(self.cone_half_angle) + (
            self.pad_height_above_groove
        )
