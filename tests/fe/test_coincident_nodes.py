"""Nodes at one place are found in pairs, whatever the unit of length; neighbours in a mesh are none."""

from dataclasses import replace

import numpy as np
import pytest

from fe.coincident_nodes import find_coincident_nodes
from fe.element import Element
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e3])
def test_the_nodes_of_a_seam_are_found(element: Element, unit: float) -> None:
    one = mesh_blocks([Block.box(((0, 2), (0, 1), (0, 1)), (2, 2, 1), {"u1": "seam"})], element)
    (kind,) = one.cells
    two = Mesh(
        points=unit * np.vstack([one.points, np.add(one.points, [2, 0, 0])]),
        cells={kind: np.vstack([one.cells[kind], one.cells[kind] + one.n_node])},
    )
    seam = find_coincident_nodes(two)
    assert len(seam) == len(one.nodes("seam"))
    np.testing.assert_array_equal(two.points[seam[:, 0], 0], 2 * unit)
    assert not len(find_coincident_nodes(replace(one, points=unit * one.points)))
