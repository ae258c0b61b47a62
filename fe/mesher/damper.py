"""Mapped hexahedra for the bi-conical damper: a core and four quarters around it, swept along the axis."""

from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from math import pi

import numpy as np

from fe.element import Element
from fe.mesh import Mesh
from fe.mesher.block import Block, Coordinates, Lattice
from fe.mesher.body import mesh_body
from fe.mesher.mesh_rule import check_counts
from geometry.damper import Damper, contact_lines, named_points
from geometry.placement import Placement

#: Half the side of the core over the damper's radius, and bulge of its sides; chosen so that cells are nearly square.
CORE, BULGE = 0.4, 0.25


@dataclass(frozen=True, kw_only=True)
class DamperMesh:
    """Numbers of elements of a damper.

    Parameters
    ----------
    along_contact
        Number along each contact line [-]; a multiple of 6 puts the 7 stations on corner nodes.
    along_cylinder
        Number along the cylinder, even so that the point of the dead weight in its middle is a node [-].
    around_quarter
        Number around a quarter of the circumference, even so that the crest runs along nodes [-].
    across
        Number from the core to the surface [-].
    """

    along_contact: int = 6
    along_cylinder: int = 6
    around_quarter: int = 4
    across: int = 2

    def __post_init__(self) -> None:
        check_counts(
            "dampers",
            vars(self),
            even=("along_cylinder", "around_quarter"),
            why_even="so that nodes lie where the damper is touched and loaded",
        )


def mesh_damper(
    damper: Damper,
    element: Element,
    cells: DamperMesh | None = None,
    *,
    placement: Placement | None = None,
    subdivisions: int = 1,
) -> Mesh:
    """Mesh a damper.

    Parameters
    ----------
    damper
        Dimensions of the damper [m].
    element
        Any registered element.
    cells
        Numbers of elements.
    placement
        Placement in the rig; the local axes of the damper by default.
    subdivisions
        Number of parts into which each element is divided along each edge [-].

    Returns
    -------
    Mesh with the face sets "cone_blade", "cone_decoupler", "cylinder", "end_blade", "end_decoupler" and the node sets
    "contact_blade", "contact_decoupler", "dead_weight", "laser_blade" and "laser_decoupler".

    Raises
    ------
    MeshError
        The contact stations are not on corner nodes.
    """
    return mesh_body(
        _make_blocks(damper, cells or DamperMesh()),
        element,
        points=named_points(damper),
        lines=contact_lines(damper),
        placement=placement,
        subdivisions=subdivisions,
    )


def _make_blocks(damper: Damper, cells: DamperMesh) -> list[Block]:
    """Core and quarters of each part along the axis."""
    middle, contact_end, end = (
        damper.cylinder_length / 2,
        damper.cylinder_length / 2 + damper.shoulder,
        damper.half_length,
    )
    places = (-end, -contact_end, -middle, middle, contact_end, end)
    counts = (cells.along_contact, 1, cells.along_cylinder, 1, cells.along_contact)
    names = ("cone_blade", "cone_blade", "cylinder", "cone_decoupler", "cone_decoupler")
    radii = {
        end: damper.end_radius, contact_end: damper.wide_radius, middle: damper.radius
    }  # fmt: skip
    blocks = []
    for (start, stop), count, name in zip(pairwise(places), counts, names, strict=True):
        ends = {"w0": "end_blade"} if start == -end else {"w1": "end_decoupler"} if stop == end else {}
        sweep = _Sweep(start=start, stop=stop, start_radius=radii[abs(start)], stop_radius=radii[abs(stop)])
        n = cells.around_quarter
        blocks.append(Block(shape=sweep.core, counts=(n, n, count), faces=ends))
        for quarter in range(4):
            shape = partial(sweep.quarter, quarter * pi / 2)
            blocks.append(Block(shape=shape, counts=(n, cells.across, count), faces={**ends, "v1": name}))
    return blocks


@dataclass(frozen=True, kw_only=True)
class _Sweep:
    """Part of the damper between two sections [m]."""

    start: float
    stop: float
    start_radius: float
    stop_radius: float

    def along(self, w: Lattice) -> tuple[Lattice, Lattice]:
        """Position on the axis, and radius there."""
        return (
            self.start + (self.stop - self.start) * w,
            self.start_radius + (self.stop_radius - self.start_radius) * w,
        )

    def core(self, u: Lattice, v: Lattice, w: Lattice) -> Coordinates:
        """The square core with bulged sides."""
        y, radius = self.along(w)
        x, z = _map_core(2 * u - 1, 2 * v - 1)
        return radius * x, y, radius * z

    def quarter(self, turn: float, u: Lattice, v: Lattice, w: Lattice) -> Coordinates:
        """Quarter from the core's upper side (v = 0) to the surface (v = 1), rotated about the axis."""
        y, radius = self.along(w)
        t = 2 * u - 1
        x, z = _map_core(t, np.ones_like(t))
        angle = t * pi / 4
        x, z = x + (np.sin(angle) - x) * v, z + (np.cos(angle) - z) * v
        return radius * (x * np.cos(turn) + z * np.sin(turn)), y, radius * (z * np.cos(turn) - x * np.sin(turn))


def _map_core(s: Lattice, t: Lattice) -> tuple[Lattice, Lattice]:
    """Point of the core over the damper's radius, for s and t in [-1, 1]."""
    return CORE * s * (1 + BULGE * (1 - t**2)), CORE * t * (1 + BULGE * (1 - s**2))
