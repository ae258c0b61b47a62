"""Mapped hexahedra for the rig's blade, with pads that follow the conical groove and its contact line."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from fe.errors import MeshError
from fe.mesh import Mesh
from fe.mesher.block import Block, Coordinates, Lattice
from fe.mesher.body import mesh_body
from fe.mesher.groove_section import PAD_COLUMNS, GroovePlan
from fe.mesher.mesh_rule import SMALLEST_STEP, MeshRule, check_counts, count_elements
from geometry.blade import Blade, contact_lines, named_points

#: Columns of blocks across the chord, from leading to trailing edge; the pads are on the inner three.
COLUMNS = ("root_left", "bevel_left", "lip_left", "groove", "lip_right", "bevel_right", "root_right")
#: Width of the middle column, as a fraction of the pad's width, at the top of the pad and at the foot of the band.
TOP_WIDTH, FOOT_WIDTH = 0.8, 0.36


@dataclass(frozen=True, kw_only=True)
class PadMesh:
    """Numbers of elements of the pads; equal in all models of a study to keep contact and local compliance equal.

    Parameters
    ----------
    along_contact
        Number along the contact line [-]; a multiple of 6 puts the 7 stations on corner nodes.
    across_groove, across_lip
        Number across the groove, even so that its crest runs along nodes, and number across each lip beside it [-].
    above_groove
        Number from the groove to the top of the pad [-].
    band, band_height
        Number of elements [-] and height [m] of the band below the pad, in which the columns become straight.
    """

    along_contact: int = 6
    across_groove: int = 6
    across_lip: int = 2
    above_groove: int = 4
    band: int = 2
    band_height: float = 0.006

    def __post_init__(self) -> None:
        counts = {name: value for name, value in vars(self).items() if name != "band_height"}
        check_counts(
            "pads",
            counts,
            even=("across_groove",),
            why_even="so that the contact line on the groove's crest runs along nodes",
        )


def mesh_blade(blade: Blade, rule: MeshRule, pads: PadMesh | None = None, layer: float | None = None) -> Mesh:
    """Mesh the blade: t / n through the thickness, h along span, chord and root block outside the pads.

    Parameters
    ----------
    blade
        Dimensions of the blade [m].
    rule
        Element and sizes outside the pads.
    pads
        Elements in the pads.
    layer
        Height to which the nearest layer of nodes below the pads is moved, such as that of a point where a force acts;
        no layer is moved by default [m].

    Returns
    -------
    Mesh with the face sets "clamp" (the block's two faces normal to y), "root_bottom", "tip", and on each side
    "groove_positive", "pad_positive", "groove_negative", "pad_negative"; and the node sets "excitation", "response",
    "contact_positive" and "contact_negative".

    Raises
    ------
    MeshError
        The contact stations are not on corner nodes; the band below the pads does not fit; or the root block is not
        thicker than the blade, so that cells beside the bevelled edges would have no thickness.
    """
    if blade.root_thickness - blade.thickness < SMALLEST_STEP:
        raise MeshError(
            f"root_thickness = {blade.root_thickness * 1e3:g} mm must exceed the thickness of the "
            f"blade, {blade.thickness * 1e3:g} mm, by an amount that can be meshed: give a thicker root block"
        )
    layout = _BladeBlocks(blade, rule, pads or PadMesh(), layer)
    blocks = [*layout.planform(), *layout.root_layers(), *layout.pads()]
    return mesh_body(
        blocks,
        rule.element,
        points=named_points(blade),
        lines=contact_lines(blade),
        subdivisions=rule.subdivisions,
    )


PlanMap = Callable[[Lattice, Lattice], tuple[Lattice, Lattice]]


class _BladeBlocks:
    """The blocks, from a plan in x and z that is extruded through the thickness."""

    def __init__(self, blade: Blade, rule: MeshRule, pads: PadMesh, layer: float | None) -> None:
        self.blade, self.pad = blade, pads
        self.through = rule.through_thickness
        h = rule.size(blade.thickness)
        self.band_foot = blade.pad_bottom - pads.band_height
        if not 0 < self.band_foot < blade.pad_bottom:
            raise MeshError(
                f"band_height = {pads.band_height * 1e3:g} mm does not fit under the pad, whose lower face is "
                f"{blade.pad_bottom * 1e3:g} mm above the root: give a height between, such as 8 mm"
            )
        half_flat, half_chord, half_root = blade.flat_width / 2, blade.chord / 2, blade.root_chord / 2
        self.groove = GroovePlan(
            half_width=half_flat,
            axis=blade.groove_axis,
            lip_above_axis=blade.lip_above_axis,
            top=blade.pad_top,
            top_width=TOP_WIDTH,
        )
        self.edges = {
            "root_left": (-half_root, -half_chord),
            "bevel_left": (-half_chord, -half_flat),
            "bevel_right": (half_flat, half_chord),
            "root_right": (half_chord, half_root),
        }
        self.column_counts = {name: count_elements(x[1] - x[0], h) for name, x in self.edges.items()}
        self.column_counts |= {"lip_left": pads.across_lip, "groove": pads.across_groove, "lip_right": pads.across_lip}
        self.rows = {
            "root": (-blade.root_height, 0.0),
            "lower": (0.0, self.band_foot),
            "band": (self.band_foot, blade.pad_bottom),
            "pad": (blade.pad_bottom, blade.pad_top),
            "upper": (blade.pad_top, blade.length),
        }
        self.row_counts = {name: count_elements(z[1] - z[0], h) for name, z in self.rows.items()}
        self.row_counts |= {"band": pads.band, "pad": pads.above_groove}
        self.level = self._level(layer)
        layer = blade.thickness / rule.through_thickness
        self.root_layer_count = count_elements((blade.root_thickness - blade.thickness) / 2, layer)
        self.columns = [c for c in COLUMNS if c in PAD_COLUMNS or self.edges[c][1] - self.edges[c][0] > SMALLEST_STEP]

    def _level(self, height: float | None) -> tuple[float, float]:
        """Position of the layer of nodes nearest to a height, as a fraction from root to band, and the height.

        The fraction is 0, and no layer is moved, if the root or the band is nearer than a layer between them.
        """
        n, (bottom, top) = self.row_counts["lower"], self.rows["lower"]
        number = 0 if height is None else round((height - bottom) / (top - bottom) * n)
        return (number / n, float(height)) if height is not None and 0 < number < n else (0.0, bottom)

    def planform(self) -> list[Block]:
        """Blade and core of the root block, with `through` elements through the thickness."""
        blocks = []
        for column, row in product(self.columns, self.rows):
            if column.startswith("root") and row != "root":
                continue
            plan = self.plan(column, row, self.blade.thickness / 2)
            counts = (self.column_counts[column], self.row_counts[row], self.through)
            faces = {"root": {"v0": "root_bottom"}, "upper": {"v1": "tip"}}.get(row, {})
            blocks.append(Block(shape=partial(self.section, plan), counts=counts, faces=faces))
        return blocks

    def section(self, plan: PlanMap, u: Lattice, v: Lattice, w: Lattice) -> Coordinates:
        """Map of a block through the thickness of the blade."""
        x, z = plan(u, v)
        return x, (2 * w - 1) * self.half_thickness(x), z

    def root_layers(self) -> list[Block]:
        """Parts of the root block in front of and behind the blade's section."""
        blocks = []
        for column, side in product(self.columns, (1, -1)):
            plan = self.plan(column, "root", self.blade.thickness / 2)
            counts = (self.column_counts[column], self.row_counts["root"], self.root_layer_count)
            shape = partial(self.beside_section, plan, side)
            blocks.append(Block(shape=shape, counts=counts, faces={"v0": "root_bottom", "w1": "clamp"}))
        return blocks

    def beside_section(self, plan: PlanMap, side: int, u: Lattice, v: Lattice, w: Lattice) -> Coordinates:
        """Map of a block of the root beside the blade's section."""
        x, z = plan(u, v)
        inner = self.half_thickness(x)
        return x, side * (inner + (self.blade.root_thickness / 2 - inner) * w), z

    def pads(self) -> list[Block]:
        """Both pads: the plan of the pad row, swept outward while the groove's radius grows."""
        blade = self.blade
        stretches = (
            (blade.thickness / 2, blade.contact_start, 1),
            (blade.contact_start, blade.pad_face, self.pad.along_contact),
        )
        blocks = []
        for (name, side), column, (near, far, n) in product(
            (("positive", 1), ("negative", -1)), PAD_COLUMNS, stretches
        ):
            shape = partial(self.groove.sweep, column, blade.groove_radius_at, (near, far), side)
            faces = {"w1": f"pad_{name}"} if far == blade.pad_face else {}
            if column == "groove":
                faces["v0"] = f"groove_{name}"
            counts = (self.column_counts[column], self.pad.above_groove, n)
            blocks.append(Block(shape=shape, counts=counts, faces=faces))
        return blocks

    def half_thickness(self, x: Lattice) -> Lattice:
        """Half of the blade's thickness at x, with bevelled edges; half the edge's thickness beyond the chord."""
        blade = self.blade
        if blade.chord - blade.flat_width < SMALLEST_STEP:
            return np.full_like(x, blade.thickness / 2)
        return np.interp(
            np.abs(x), [blade.flat_width / 2, blade.chord / 2], [blade.thickness / 2, blade.edge_thickness / 2]
        )

    def plan(self, column: str, row: str, y: float) -> PlanMap:
        """Map of u, v to x, z for one block of the plan."""
        bottom, top = self.rows[row]
        share, level = self.level if row == "lower" else (0.0, bottom)

        def height(v: Lattice) -> Lattice:
            return np.interp(v, [0.0, share, 1.0], [bottom, level, top]) if share else bottom + (top - bottom) * v

        if column not in PAD_COLUMNS:
            left, right = self.edges[column]
            return lambda u, v: (left + (right - left) * u, height(v))
        if row == "pad":
            radius = self.blade.groove_radius_at(np.asarray(y))
            return lambda u, v: self.groove.pad(column, u, v, radius)
        if row == "band":
            radius = self.blade.groove_radius_at(np.asarray(self.blade.thickness / 2))
            return lambda u, v: self.groove.below(column, u, v, radius, foot=self.band_foot, foot_width=FOOT_WIDTH)
        width = TOP_WIDTH if row == "upper" else FOOT_WIDTH
        return lambda u, v: (self.groove.straight(column, u, width), height(v))
