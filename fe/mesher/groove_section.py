"""Section of a grooved pad, divided into three columns of cells: a lip, the groove and the other lip."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe.mesher.block import Coordinates, Lattice
from geometry.groove import half_mouth

PAD_COLUMNS = ("lip_left", "groove", "lip_right")
#: Radius of a groove as a function of the distance |y| [m].
RadiusAt = Callable[[Lattice], Lattice]


@dataclass(frozen=True, kw_only=True)
class GroovePlan:
    """Section of a pad in x and z, symmetric about x = 0, with a groove that is open downwards.

    Parameters
    ----------
    half_width
        Half the width of the pad [m].
    axis
        Height z of the groove's axis [m].
    lip_above_axis
        Height of the lips above the axis [m].
    top
        Height z of the pad's upper face [m].
    top_width
        Width of the middle column at the top, as a fraction of the pad's width [-].
    """

    half_width: float
    axis: float
    lip_above_axis: float
    top: float
    top_width: float

    def straight(self, column: str, u: Lattice, width: float) -> Lattice:
        """Position x in a column, where the groove's column has the fraction `width` of the pad's width."""
        half = self.half_width
        left, right = {
            "lip_left": (-half, -width * half),
            "groove": (-width * half, width * half),
            "lip_right": (width * half, half),
        }[column]
        return left + (right - left) * u

    def line(self, column: str, u: Lattice, radius: Lattice) -> tuple[Lattice, Lattice]:
        """x, z of the pad's lower edge: lip, arc of the groove, lip."""
        half = self.half_width
        lip = half_mouth(radius, self.lip_above_axis)
        if column == "groove":
            angle = (2 * u - 1) * np.arcsin(lip / radius)
            return radius * np.sin(angle), self.axis + radius * np.cos(angle)
        x = -half + (half - lip) * u if column == "lip_left" else lip + (half - lip) * u
        return x, np.full_like(u, self.axis + self.lip_above_axis)

    def pad(self, column: str, u: Lattice, v: Lattice, radius: Lattice) -> tuple[Lattice, Lattice]:
        """x, z between the pad's lower edge (v = 0) and its top."""
        x, z = self.line(column, u, radius)
        return x + (self.straight(column, u, self.top_width) - x) * v, z + (self.top - z) * v

    def sweep(
        self, column: str, radius_at: RadiusAt, ends: tuple[float, float], side: int, u: Lattice, v: Lattice, w: Lattice
    ) -> Coordinates:
        """x, y, z of the pad swept between two |y|, on the side of +y or -y, while the groove's radius changes."""
        y = ends[0] + (ends[1] - ends[0]) * w
        x, z = self.pad(column, u, v, radius_at(y))
        return x, side * y, z

    def below(
        self, column: str, u: Lattice, v: Lattice, radius: Lattice, *, foot: float, foot_width: float
    ) -> tuple[Lattice, Lattice]:
        """x, z between straight columns at the height `foot` (v = 0) and the pad's lower edge."""
        x, z = self.line(column, u, radius)
        start = self.straight(column, u, foot_width)
        return start + (x - start) * v, foot + (z - foot) * v
