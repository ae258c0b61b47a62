"""From the blocks of a body in its own axes to its mesh where it stands, with its points and contact stations."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fe.element import Element
from fe.mesh import Mesh
from fe.mesher.block import Block, Lattice, Map, mesh_blocks, subdivide
from fe.node_sets import add_named_points, add_stations
from geometry.interface import ContactLine
from geometry.part import Point
from geometry.placement import Placement


def mesh_body(
    blocks: Sequence[Block],
    element: Element,
    *,
    points: Mapping[str, Point],
    lines: Mapping[str, ContactLine],
    placement: Placement | None = None,
    subdivisions: int = 1,
) -> Mesh:
    """Mesh a body.

    Parameters
    ----------
    blocks
        In the body's own axes; mirrored ones are turned right.
    element
        Any element; tetrahedra are cut from the hexahedra.
    points, lines
        What node sets are made for, in the body's own axes [m].
    placement
        Where the body stands; in its own axes by default.
    subdivisions
        Each element is cut into this many along each edge [-].

    Raises
    ------
    MeshError
        The stations of a line are not on corner nodes.
    """
    place = placement or Placement()
    placed = [replace(block, shape=_moved(block.shape, place)) for block in subdivide(blocks, subdivisions)]
    mesh = mesh_blocks(placed, element)
    mesh = add_named_points(mesh, {name: place.points(point) for name, point in points.items()})
    return add_stations(mesh, {name: place.points(line.stations) for name, line in lines.items()})


def _moved(shape: Map, placement: Placement) -> Map:
    def moved(u: Lattice, v: Lattice, w: Lattice) -> tuple[Lattice, Lattice, Lattice]:
        points = placement.points(np.stack(np.broadcast_arrays(*shape(u, v, w)), axis=-1))
        return points[..., 0], points[..., 1], points[..., 2]

    return moved
