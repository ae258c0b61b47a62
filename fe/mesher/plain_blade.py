"""Mapped hexahedra for the plain blade: straight blocks, all cells affine."""

from itertools import product

from fe.mesh import Mesh
from fe.mesher.block import Block, Interval, mesh_blocks, subdivide
from fe.mesher.mesh_rule import SMALLEST_STEP, MeshRule, count_elements
from fe.node_sets import add_named_points
from geometry.plain_blade import PlainBlade, named_points


def mesh_plain_blade(blade: PlainBlade, rule: MeshRule) -> Mesh:
    """Mesh the plain blade: element size t / n through the thickness (also beside it), h along span and chord.

    Parameters
    ----------
    blade
        Dimensions of the blade [m].
    rule
        Element and sizes.

    Returns
    -------
    Mesh with the face sets "clamp" (the block's two faces normal to y), "root_bottom" and "tip", and the node sets
    "excitation" and "response".
    """
    h = rule.size(blade.thickness)
    layer = blade.thickness / rule.through_thickness
    half, half_root = blade.thickness / 2, blade.root_thickness / 2
    span = {"root": (-blade.root_height, 0.0), "blade": (0.0, blade.length)}
    chord: list[Interval] = [(-blade.chord / 2, blade.chord / 2)]
    if blade.root_chord - blade.chord > SMALLEST_STEP:
        chord = [(-blade.root_chord / 2, -blade.chord / 2), *chord, (blade.chord / 2, blade.root_chord / 2)]
    depth: list[Interval] = [(-half, half)]
    if blade.root_thickness - blade.thickness > SMALLEST_STEP:
        depth = [(-half_root, -half), *depth, (half, half_root)]
    middle_x, middle_y = len(chord) // 2, len(depth) // 2
    blocks = []
    for part, (i, x), (j, y) in product(span, enumerate(chord), enumerate(depth)):
        in_section = i == middle_x and j == middle_y
        if part == "blade" and not in_section:
            continue
        counts = (
            count_elements(x[1] - x[0], h),
            rule.through_thickness if j == middle_y else count_elements(y[1] - y[0], layer),
            count_elements(span[part][1] - span[part][0], h),
        )
        faces = {"w0": "root_bottom"} if part == "root" else {"w1": "tip"}
        if part == "root":
            faces |= {"v0": "clamp"} if j == 0 else {}
            faces |= {"v1": "clamp"} if j == len(depth) - 1 else {}
        blocks.append(Block.box((x, y, span[part]), counts, faces))
    mesh = mesh_blocks(subdivide(blocks, rule.subdivisions), rule.element)
    return add_named_points(mesh, named_points(blade))
