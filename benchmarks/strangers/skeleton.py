"""Skeletons: mass, stiffness and a table of degrees of freedom of structures without joints, from a refinable mesh.

The fine mesh has all nodes of the coarse one, so that a `Spot` (body, point, direction) is the same motion in both.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.strangers.element import frame_element, plate_element

Matrix = NDArray[np.float64]
Row = NDArray[np.float64]

#: Directions of the degrees of freedom of a node of frames and plates.
FRAME, PLATE = ("x", "z", "ry"), ("z", "rx", "ry")
#: Distance below which two points are one node [m].
SAME_POINT = 1e-9


@dataclass(frozen=True)
class Spot:
    """Motion of a point: body, coordinates [m] and direction."""

    body: str
    point: tuple[float, float, float]
    direction: str


#: Linear combination of motions: spots with weights.
Motion = tuple[tuple[Spot, float], ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Skeleton:
    """Mass and stiffness, shape (r, r), and spot of each degree of freedom, without supported ones."""

    mass: Matrix
    stiffness: Matrix
    spots: tuple[Spot, ...]

    def number(self, spot: Spot) -> int:
        """Degree of freedom of a spot."""
        for number, item in enumerate(self.spots):
            if (item.body, item.direction) == (spot.body, spot.direction) and np.allclose(
                item.point, spot.point, rtol=0, atol=SAME_POINT
            ):
                return number
        raise LookupError(f"no degree of freedom at {spot}")

    def row(self, motion: Motion) -> Row:
        """Row of a motion over the degrees of freedom, shape (r,)."""
        row = np.zeros(len(self.spots))
        for spot, weight in motion:
            row[self.number(spot)] += weight
        return row


@dataclass(frozen=True, kw_only=True, eq=False)
class Chain:
    """Masses in a line that move along x, with springs between pairs of masses and to the ground."""

    masses: Sequence[float]
    springs: Mapping[tuple[int, int], float]
    grounded: Mapping[int, float]

    def build(self, refine: int) -> Skeleton:
        """Build the skeleton; a chain has no mesh to refine."""
        del refine
        stiffness = np.diag([self.grounded.get(number, 0.0) for number in range(len(self.masses))])
        for (one, other), spring in self.springs.items():
            row = np.zeros(len(self.masses))
            row[one], row[other] = 1.0, -1.0
            stiffness += spring * np.outer(row, row)
        spots = tuple(Spot("chain", (0.1 * number, 0.0, 0.0), "x") for number in range(len(self.masses)))
        return Skeleton(mass=np.diag(self.masses), stiffness=stiffness, spots=spots)


@dataclass(frozen=True, kw_only=True, eq=False)
class Member:
    """Straight beam of a body between two points [m], with the number of elements in the coarse mesh."""

    body: str
    begin: tuple[float, float, float]
    end: tuple[float, float, float]
    n_element: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """Beams in the plane x, z that are welded at common points.

    Parameters
    ----------
    members
        Beams.
    section
        Axial stiffness EA [N], bending stiffness EI [N m^2] and mass per length rho A [kg/m].
    fixed
        Fixed spots; the direction "*" fixes the whole node.
    springs
        Stiffness of springs to the ground [N/m].
    axial
        Whether the nodes also move along x.
    """

    members: Sequence[Member]
    section: tuple[float, float, float]
    fixed: Sequence[Spot]
    springs: Mapping[Spot, float]
    axial: bool

    def build(self, refine: int) -> Skeleton:
        """Build the skeleton with `refine` times as many elements."""
        assembly = _Assembly(FRAME)
        for member in self.members:
            begin, end = np.array(member.begin), np.array(member.end)
            n = refine * member.n_element
            points = [begin + (end - begin) * number / n for number in range(n + 1)]
            for one, other in pairwise(points):
                assembly.add(member.body, [one, other], *frame_element(one, other, *self.section))
        return assembly.finish(self.fixed, self.springs, () if self.axial else ("x",))


@dataclass(frozen=True, kw_only=True, eq=False)
class Plate:
    """Rectangular plate in bending in the plane x, y.

    Parameters
    ----------
    size
        Lengths along x and y [m].
    n_element
        Number of elements along x and y in the coarse mesh.
    section
        Bending stiffness [N m], Poisson's ratio [-] and mass per area [kg/m^2].
    clamped
        Axes (0 for x, 1 for y) whose edge at zero is clamped, at the nodes of every mesh.
    springs
        Stiffness of springs to the ground [N/m].
    """

    size: tuple[float, float]
    n_element: tuple[int, int]
    section: tuple[float, float, float]
    clamped: Sequence[int]
    springs: Mapping[Spot, float]

    def build(self, refine: int) -> Skeleton:
        """Build the skeleton with `refine` times as many elements along each edge."""
        nx, ny = (refine * count for count in self.n_element)
        a, b = self.size[0] / nx, self.size[1] / ny
        matrices = plate_element(a, b, *self.section)
        assembly = _Assembly(PLATE)
        for i in range(nx):
            for j in range(ny):
                corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                assembly.add("plate", [np.array([a * p, b * q, 0.0]) for p, q in corners], *matrices)
        edge = [spot for spot in assembly.spots if any(spot.point[axis] == 0 for axis in self.clamped)]
        return assembly.finish([replace(spot, direction="*") for spot in edge], self.springs, ())


class _Assembly:
    """Assembly of element matrices; nodes are identified by body and point."""

    def __init__(self, directions: Sequence[str]) -> None:
        self.directions = directions
        self.nodes: dict[tuple[Any, ...], int] = {}
        self.spots: list[Spot] = []
        self.elements: list[tuple[list[int], Matrix, Matrix]] = []

    def add(self, body: str, points: Sequence[Row], mass: Matrix, stiffness: Matrix) -> None:
        """Add an element with nodes at the given points."""
        numbers: list[int] = []
        for point in points:
            key = (body, *(round(float(item), 9) for item in point))
            if key not in self.nodes:
                self.nodes[key] = len(self.spots)
                x, y, z = (float(item) for item in point)
                self.spots += [Spot(body, (x, y, z), direction) for direction in self.directions]
            first = self.nodes[key]
            numbers += range(first, first + len(self.directions))
        self.elements.append((numbers, mass, stiffness))

    def finish(self, fixed: Sequence[Spot], springs: Mapping[Spot, float], without: Sequence[str]) -> Skeleton:
        """Assemble the skeleton, without fixed degrees of freedom and without some directions."""
        r = len(self.spots)
        mass, stiffness = np.zeros((r, r)), np.zeros((r, r))
        for numbers, element_mass, element_stiffness in self.elements:
            mass[np.ix_(numbers, numbers)] += element_mass
            stiffness[np.ix_(numbers, numbers)] += element_stiffness
        whole = Skeleton(mass=mass, stiffness=stiffness, spots=tuple(self.spots))
        for spot, spring in springs.items():
            stiffness[whole.number(spot), whole.number(spot)] += spring
        held = {(item.body, item.point) for item in fixed if item.direction == "*"}
        alone = {item for item in fixed if item.direction != "*"}
        moving = [
            number
            for number, spot in enumerate(self.spots)
            if (spot.body, spot.point) not in held and spot not in alone and spot.direction not in without
        ]
        return Skeleton(
            mass=mass[np.ix_(moving, moving)],
            stiffness=stiffness[np.ix_(moving, moving)],
            spots=tuple(self.spots[number] for number in moving),
        )
