"""Blocks of a body in its own axes, where it stands in an assembly."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fe.hex_blocks import Block, Lattice, Map
from geometry.placement import Placement


def placed(blocks: Sequence[Block], placement: Placement) -> list[Block]:
    """The same blocks with maps into the assembly's axes; mirrored ones are turned right by the mesher."""
    return [replace(block, shape=_moved(block.shape, placement)) for block in blocks]


def _moved(shape: Map, placement: Placement) -> Map:
    def moved(u: Lattice, v: Lattice, w: Lattice) -> tuple[Lattice, Lattice, Lattice]:
        points = placement.points(np.stack(np.broadcast_arrays(*shape(u, v, w)), axis=-1))
        return points[..., 0], points[..., 1], points[..., 2]

    return moved
