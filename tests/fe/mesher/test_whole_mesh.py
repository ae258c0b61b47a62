"""Several bodies as one mesh: nothing is lost, and every set is where it was."""

import numpy as np
import pytest

from fe.element import HEX8, HEX20, Element
from fe.errors import MeshError
from fe.mesh import Mesh
from fe.mesher.body import join_meshes


def bar(element: Element, n_cell: int, shift: float) -> Mesh:
    """Cubes in a row, each with nodes of its own; the last one has a node set and a face set."""
    points = [element.nodes + np.array([3.0 * k + shift, 0, 0]) for k in range(n_cell)]
    cells = np.arange(n_cell * element.n_node).reshape(n_cell, -1)
    sets = {"node_sets": {"last": cells[-1]}, "face_sets": {"end": np.array([[n_cell - 1, 2], [0, 1]])}}
    return Mesh(points=np.concatenate(points), cells={element.cell_type: cells}, **sets)


def test_all_bodies_are_in_it_with_their_sets_where_they_were(element: Element) -> None:
    meshes = {"short": bar(element, 2, 0.0), "long": bar(element, 3, 20.0)}
    whole = join_meshes(meshes)
    assert whole.n_node == 5 * element.n_node
    assert {body: list(cells) for body, cells in whole.cell_sets.items()} == {"short": [0, 1], "long": [2, 3, 4]}
    for body, mesh in meshes.items():
        cells = whole.cells[element.cell_type][whole.cell_sets[body]]
        np.testing.assert_array_equal(whole.points[cells], mesh.points[mesh.cells[element.cell_type]])
        for name in ("last", "end"):
            np.testing.assert_array_equal(whole.points[whole.nodes(f"{body}.{name}")], mesh.points[mesh.nodes(name)])


def test_bodies_of_several_elements_are_refused() -> None:
    with pytest.raises(MeshError, match="types hexahedron, hexahedron20 do not make one mesh"):
        join_meshes({"coarse": bar(HEX8, 1, 0.0), "fine": bar(HEX20, 1, 5.0)})
