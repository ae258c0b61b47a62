"""Mesh the five bodies of the rig with cells of about one size."""

from dataclasses import dataclass, field
from math import asin, ceil, isfinite, pi, sin, sqrt

from fe.element import Element
from fe.errors import MeshError
from fe.mesh import Mesh
from fe.mesher.blade import PadMesh, mesh_blade
from fe.mesher.damper import DamperMesh, mesh_damper
from fe.mesher.decoupler import DecouplerMesh, mesh_decoupler
from fe.mesher.mesh_rule import MeshRule
from fe.node_sets import add_named_points
from geometry.decoupler import Decoupler
from geometry.groove import half_mouth
from geometry.rig import Rig, named_points, placements

#: Length of an element over its thickness [-], and largest length of an element [m], in the slender blade outside its
#: pads.
LENGTH_RATIO, LENGTH_CAP = 2.4, 0.008
#: Number of intervals between the contact stations of a line.
INTERVALS = 6


@dataclass(frozen=True, kw_only=True)
class RigMesh:
    """Mesh parameters of the five bodies; `choose_rig_mesh` computes them from a size.

    Parameters
    ----------
    blade, pads
        Mesh rule of the blade, and numbers of elements of its pads.
    damper, decoupler
        Numbers of elements of both dampers and of both de-couplers.
    """

    blade: MeshRule
    pads: PadMesh = field(default_factory=PadMesh)
    damper: DamperMesh = field(default_factory=DamperMesh)
    decoupler: DecouplerMesh = field(default_factory=DecouplerMesh)


def choose_rig_mesh(rig: Rig, element: Element, size: float, subdivisions: int = 1) -> RigMesh:
    """Mesh parameters for cells of about one size in all bodies, as regular as the contact lines and points allow.

    Parameters
    ----------
    rig
        The rig.
    element
        Any registered element.
    size
        Length of the cells' edges [m].
    subdivisions
        Number of parts into which each cell is divided along each edge [-]: 1, 2, 4, ... give nested meshes.

    Raises
    ------
    MeshError
        The size is not positive.
    """
    if not (isfinite(size) and size > 0):
        raise MeshError(f"an element size of {size * 1e3:g} mm is not positive: 2.5 mm is a usual value")

    def near(length: float, multiple: int = 1) -> int:
        return multiple * max(1, round(length / (multiple * size)))

    blade, damper, decoupler = rig.blade, rig.damper, rig.decoupler
    mouth = float(half_mouth(blade.narrow_groove_radius, blade.lip_above_axis))
    across_groove = near(2 * blade.narrow_groove_radius * asin(mouth / blade.narrow_groove_radius), 2)
    across_lip = near(blade.flat_width / 2 - mouth)
    along_contact = near(damper.contact_length, INTERVALS)
    across_neck = near(decoupler.neck_thickness, 2)
    # The plate has as many rows as both arms, but is taller: the geometric mean of both heights gives the number.
    across_arm = sqrt(decoupler.arm_thickness * decoupler.half_height)
    beside_neck = max(1, ceil((across_arm - decoupler.neck_thickness) / (2 * size)))
    below, above = _count_beside_pad(decoupler, 2 * (across_neck + 2 * beside_neck))
    return RigMesh(
        blade=MeshRule(
            element=element,
            through_thickness=near(blade.thickness),
            length_ratio=LENGTH_RATIO,
            length_cap=LENGTH_CAP,
            subdivisions=subdivisions,
        ),
        pads=PadMesh(
            along_contact=along_contact,
            across_groove=across_groove,
            across_lip=across_lip,
            above_groove=near(blade.pad_height_above_groove),
            band=near(PadMesh.band_height),
        ),
        damper=DamperMesh(
            along_contact=along_contact,
            along_cylinder=near(damper.cylinder_length, 2),
            around_quarter=near(damper.radius * pi / 2, 2),
            across=near(damper.radius / 2),
        ),
        decoupler=DecouplerMesh(
            along_contact=along_contact,
            across_groove=across_groove,
            across_lip=across_lip,
            across_neck=across_neck,
            beside_neck=beside_neck,
            below_groove=below,
            above_pad=above,
            through_plate=near(decoupler.plate_thickness),
            along_root=near(decoupler.half_height * sin(decoupler.arm_angle) + decoupler.stub_length),
            along_neck=near(decoupler.neck_length),
            along_arm=near(decoupler.arm_length),
            along_cell=near(decoupler.cell_length),
        ),
    )


def _count_beside_pad(decoupler: Decoupler, n_row: int) -> tuple[int, int]:
    """Numbers of rows of a de-coupler's plate below the groove and above the pad; rows are equal at its back [-]."""
    height = 2 * decoupler.half_height / n_row
    groove = (decoupler.lip_above_axis + decoupler.narrow_groove_radius) / 2
    below = min(max(1, round((groove - decoupler.plate_bottom) / height)), n_row - 2)
    above = min(max(1, round((decoupler.plate_top - decoupler.top) / height)), n_row - 1 - below)
    return below, above


def mesh_rig(rig: Rig, cells: RigMesh) -> dict[str, Mesh]:
    """Mesh all bodies in their places.

    Returns
    -------
    Meshes by body, as `geometry.rig.placements` names them, with the sets of `mesh_blade`, `mesh_damper` and
    `mesh_decoupler`; the blade has the points "laser_left" and "laser_right" as well.

    Raises
    ------
    MeshError
        As in these functions.
    """
    element, subdivisions = cells.blade.element, cells.blade.subdivisions
    lasers = {name: point for name, point in named_points(rig)["blade"].items() if name.startswith("laser")}
    # The disc on which the shaker acts spans few elements: a layer of nodes through its centre resolves it best.
    blade = mesh_blade(rig.blade, cells.blade, cells.pads, rig.blade.excitation_height)
    result = {"blade": add_named_points(blade, lasers)}
    for body, place in placements(rig).items():
        if body.startswith("damper"):
            result[body] = mesh_damper(rig.damper, element, cells.damper, placement=place, subdivisions=subdivisions)
        elif body.startswith("decoupler"):
            result[body] = mesh_decoupler(
                rig.decoupler, element, cells.decoupler, placement=place, subdivisions=subdivisions
            )
    return result
