"""Mapped hexahedra for the L-shaped de-coupler: grooved pad, plate, and two arms with necks and load cells."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from fe.element import Element
from fe.errors import MeshError
from fe.mesh import Mesh
from fe.mesher.block import Block, Coordinates, Interval, Lattice
from fe.mesher.body import mesh_body
from fe.mesher.groove_section import PAD_COLUMNS, GroovePlan
from fe.mesher.mesh_rule import SMALLEST_STEP, check_counts
from geometry.decoupler import Decoupler, arm, contact_lines, named_points
from geometry.placement import Placement

#: Width of the groove's column, as a fraction of the whole width, at the top of the pad, at the foot and at the head of
#: the plate, and in the arms.
TOP_WIDTH, FOOT_WIDTH, HEAD_WIDTH, ARM_WIDTH = 0.8, 0.36, 0.6, 0.4


@dataclass(frozen=True, kw_only=True)
class DecouplerMesh:
    """Numbers of elements of a de-coupler.

    Parameters
    ----------
    along_contact
        Number along the contact line [-]; a multiple of 6 puts the 7 stations on corner nodes.
    across_groove, across_lip
        Number across the groove, even so that its crest runs along nodes, and number across each lip beside it [-].
    across_neck, beside_neck
        Number across the neck of an arm, even so that the middle of the load cell's end is a node, and number across
        the thicker arm on each side of the neck [-].
    below_groove, above_pad
        Numbers of rows of the plate below the groove and above the pad; the plate has as many rows as both arms, and
        the pad has the rest [-].
    through_plate, along_root, along_neck, along_arm, along_cell
        Numbers through the plate, from its back to the necks, and along the parts of an arm [-].
    """

    along_contact: int = 6
    across_groove: int = 6
    across_lip: int = 2
    across_neck: int = 2
    beside_neck: int = 1
    below_groove: int = 3
    above_pad: int = 3
    through_plate: int = 3
    along_root: int = 6
    along_neck: int = 4
    along_arm: int = 10
    along_cell: int = 6

    def __post_init__(self) -> None:
        check_counts(
            "de-couplers",
            vars(self),
            even=("across_groove", "across_neck"),
            why_even="so that nodes lie on the contact line and in the middle of the load cells",
        )
        if self.below_groove + self.above_pad >= 2 * self.across_arm:
            raise MeshError(
                f"de-couplers: below_groove = {self.below_groove} and above_pad = {self.above_pad} elements leave none "
                f"for the pad: the plate has {2 * self.across_arm} in all, so give fewer"
            )

    @property
    def across_arm(self) -> int:
        """Number of elements across an arm [-]."""
        return self.across_neck + 2 * self.beside_neck


def mesh_decoupler(
    decoupler: Decoupler,
    element: Element,
    cells: DecouplerMesh | None = None,
    *,
    placement: Placement | None = None,
    subdivisions: int = 1,
) -> Mesh:
    """Mesh a de-coupler.

    Parameters
    ----------
    decoupler
        Dimensions of the de-coupler [m].
    element, cells, placement, subdivisions
        As in `fe.mesher.damper.mesh_damper`.

    Returns
    -------
    Mesh with the face sets "groove", "pad", "cell_upper", "cell_lower" and the node sets "contact" and "laser".

    Raises
    ------
    MeshError
        The contact stations are not on corner nodes.
    """
    layout = _DecouplerBlocks(decoupler, cells or DecouplerMesh())
    return mesh_body(
        [*layout.pad(), *layout.plate(), *layout.arms()],
        element,
        points={"laser": named_points(decoupler)["laser"]},
        lines=contact_lines(decoupler),
        placement=placement,
        subdivisions=subdivisions,
    )


class _DecouplerBlocks:
    """Blocks, column by column across the width."""

    def __init__(self, decoupler: Decoupler, cells: DecouplerMesh) -> None:
        self.body, self.cells, self.arm = decoupler, cells, arm(decoupler)
        self.groove = GroovePlan(
            half_width=decoupler.width / 2,
            axis=0.0,
            lip_above_axis=decoupler.lip_above_axis,
            top=decoupler.top,
            top_width=TOP_WIDTH,
        )
        self.columns = dict(zip(PAD_COLUMNS, (cells.across_lip, cells.across_groove, cells.across_lip), strict=True))
        half, neck = decoupler.arm_thickness / 2, decoupler.neck_thickness / 2
        #: Rows across an arm, from the inside out: two offsets from its centre line, and number of cells between them.
        self.neck_row = (-neck, neck, cells.across_neck)
        self.rows = [self.neck_row]
        if half - neck > SMALLEST_STEP:
            self.rows = [(-half, -neck, cells.beside_neck), *self.rows, (neck, half, cells.beside_neck)]
        self.n_across = sum(n for *_, n in self.rows)
        # Arms that are not thicker than their necks have fewer rows; each part of the plate needs at least one row.
        self.n_low = min(cells.below_groove, 2 * self.n_across - 2)
        self.n_high = min(cells.above_pad, 2 * self.n_across - 1 - self.n_low)
        self.n_pad = 2 * self.n_across - self.n_low - self.n_high

    def pad(self) -> list[Block]:
        """The pad's section, swept towards the plate while the groove's radius shrinks."""
        body = self.body
        stretches = ((0.0, body.contact_length, self.cells.along_contact), (body.contact_length, body.plate_front, 1))
        blocks = []
        for (column, n_column), (near, far, n) in ((c, s) for c in self.columns.items() for s in stretches):
            shape = partial(self.groove.sweep, column, body.groove_radius_at, (near, far), 1)
            faces = {"v0": "groove"} if column == "groove" else {}
            if near == 0.0:
                faces["w0"] = "pad"
            blocks.append(Block(shape=shape, counts=(n_column, self.n_pad, n), faces=faces))
        return blocks

    def plate(self) -> list[Block]:
        """Plate, from the section behind the pad to the straight rows at which the arms start."""
        n = (2 * self.n_across, self.cells.through_plate)
        return [
            Block(shape=partial(self.through_plate, column), counts=(n_column, *n))
            for column, n_column in self.columns.items()
        ]

    def through_plate(self, column: str, u: Lattice, v: Lattice, w: Lattice) -> Coordinates:
        """Map of a column of the plate."""
        body, row, radius = self.body, v * (2 * self.n_across), np.asarray(self.body.narrow_groove_radius)
        low = self.groove.below(column, u, row / self.n_low, radius, foot=body.plate_bottom, foot_width=FOOT_WIDTH)
        pad = self.groove.pad(column, u, (row - self.n_low) / self.n_pad, radius)
        high = self.head(column, u, (row - self.n_low - self.n_pad) / self.n_high)
        front_x, front_z = (
            np.where(row <= self.n_low, a, np.where(row <= self.n_low + self.n_pad, b, c))
            for a, b, c in zip(low, pad, high, strict=True)
        )
        side = np.sign(row - self.n_across)
        back_z = body.middle + side * body.half_height * self.share(np.abs(row - self.n_across))
        back_x = self.groove.straight(column, u, ARM_WIDTH)
        y = body.plate_front + body.plate_thickness * w
        return front_x + (back_x - front_x) * w, y, front_z + (back_z - front_z) * w

    def arms(self) -> list[Block]:
        """Both arms, from the plate's back to the ends of the load cells."""
        cells, stations = self.cells, self.arm.stations
        stretches = [*pairwise(stations)]
        neck, beam, cell = stretches
        blocks = []
        for side, end in ((1, "cell_upper"), (-1, "cell_lower")):
            blocks += [
                Block(shape=partial(self.root, column, side), counts=(n_column, self.n_across, cells.along_root))
                for column, n_column in self.columns.items()
            ]
            blocks += self.stretch(side, neck, [self.neck_row], cells.along_neck, {})
            blocks += self.stretch(side, beam, self.rows, cells.along_arm, {})
            blocks += self.stretch(side, cell, self.cell_rows(), cells.along_cell, {"w1": end})
        return blocks

    def cell_rows(self) -> list[tuple[float, float, int]]:
        """Rows across a load cell: the rows of an arm, and one more on each side if the cell is thicker."""
        half, wide = self.body.arm_thickness / 2, self.body.cell_thickness / 2
        if wide - half < SMALLEST_STEP:
            return self.rows
        return [(-wide, -half, 1), *self.rows, (half, wide, 1)]

    def stretch(
        self, side: int, ends: Interval, rows: Sequence[tuple[float, float, int]], n_along: int, faces: dict[str, str]
    ) -> list[Block]:
        """Blocks of a straight part of an arm."""
        return [
            Block(
                shape=partial(self.piece, column, side, ends, (low, high)), counts=(n_column, n, n_along), faces=faces
            )
            for column, n_column in self.columns.items()
            for low, high, n in rows
        ]

    def piece(
        self, column: str, side: int, along: Interval, across: Interval, u: Lattice, v: Lattice, w: Lattice
    ) -> Coordinates:
        """Map of a straight block of an arm, between two distances along its centre line and two offsets from it."""
        y, z = self.arm.point(along[0] + (along[1] - along[0]) * w, across[0] + (across[1] - across[0]) * v)
        return self.beside(column, side, u, y, z)

    def head(self, column: str, u: Lattice, v: Lattice) -> tuple[Lattice, Lattice]:
        """x, z between the pad's top and the plate's, on the plate's front."""
        body = self.body
        start, end = (self.groove.straight(column, u, width) for width in (TOP_WIDTH, HEAD_WIDTH))
        return start + (end - start) * v, body.top + (body.plate_top - body.top) * v

    def root(self, column: str, side: int, u: Lattice, v: Lattice, w: Lattice) -> Coordinates:
        """Map of the stub between the plate's back and a neck, which narrows to the arm's thickness."""
        row = v * self.n_across
        far_y, far_z = self.arm.point(np.full_like(v, self.arm.stations[0]), self.offset(row))
        near_z = self.body.half_height * self.share(row)
        return self.beside(column, side, u, far_y * w, near_z + (far_z - near_z) * w)

    def beside(self, column: str, side: int, u: Lattice, y: Lattice, z: Lattice) -> Coordinates:
        """Coordinates in the body's axes from those relative to the middle of the plate's back."""
        return self.groove.straight(column, u, ARM_WIDTH), self.body.plate_back + y, self.body.middle + side * z

    def offset(self, row: Lattice) -> Lattice:
        """Offset from the arm's centre line, at a number of rows from its inner face [m]."""
        edges = np.cumsum([0, *(n for *_, n in self.rows)])
        return np.interp(row, edges, [self.rows[0][0], *(high for _, high, _ in self.rows)])

    def share(self, row: Lattice) -> Lattice:
        """Distance from the arm's inner face at a number of rows, as a fraction of the arm's thickness [-]."""
        return self.offset(row) / self.body.arm_thickness + 0.5
