"""A mesh checks what it is given, keeps it, and finds its nodes by name; a material checks its constants."""

from typing import Any

import numpy as np
import pytest

from fe.element import ELEMENTS, Element
from fe.errors import MeshError
from fe.material import STEEL, Material
from fe.mesh import Mesh
from geometry.errors import InputError


def two_cells(element: Element, **more: Any) -> Mesh:
    """Two cubes side by side, each with nodes of its own."""
    points = np.concatenate([element.nodes, element.nodes + np.array([3, 0, 0])])
    return Mesh(points=points, cells={element.cell_type: np.arange(2 * element.n_node).reshape(2, -1)}, **more)


def test_arrays_are_copied_and_read_only(element: Element) -> None:
    points, chosen = element.nodes.copy(), np.array([0, 1])
    cells = {element.cell_type: np.arange(element.n_node)[None]}
    mesh = Mesh(points=points, cells=cells, node_sets={"few": chosen})
    points[:] = 7
    chosen[:] = 0
    cells.clear()
    np.testing.assert_array_equal(mesh.points, element.nodes)
    np.testing.assert_array_equal(mesh.nodes("few"), [0, 1])
    assert mesh.n_cell == 1
    for array in (mesh.points, mesh.cells[element.cell_type], mesh.node_sets["few"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(TypeError):
        mesh.node_sets["more"] = chosen  # type: ignore[index]


def test_nodes_of_a_face_set_are_those_of_its_faces(element: Element) -> None:
    faces = np.array([[1, 0], [1, 3], [0, 2]])
    mesh = two_cells(element, face_sets={"some": faces}, node_sets={"twice": np.array([3, 1, 3])})
    expected = {element.n_node * cell + node for cell, face in faces for node in element.faces[face]}
    assert mesh.nodes("some").tolist() == sorted(expected)
    assert mesh.nodes("twice").tolist() == [1, 3]


def test_corner_nodes_are_those_without_the_midsides(element: Element) -> None:
    corners = np.concatenate([np.arange(element.n_corner), element.n_node + np.arange(element.n_corner)])
    np.testing.assert_array_equal(two_cells(element).corner_nodes(), corners)


def test_faces_are_numbered_through_blocks_of_different_type() -> None:
    first, second = list(ELEMENTS.values())[:2]
    points = np.concatenate([first.nodes, second.nodes + np.array([3, 0, 0])])
    mesh = Mesh(
        points=points,
        cells={
            first.cell_type: np.arange(first.n_node)[None],
            second.cell_type: first.n_node + np.arange(second.n_node)[None],
        },
        face_sets={"far": np.array([[1, 2]])},
    )
    assert mesh.nodes("far").tolist() == sorted(first.n_node + node for node in second.faces[2])


def test_an_unknown_name_shows_the_names_there_are(element: Element) -> None:
    mesh = two_cells(element, node_sets={"tip": np.array([0])}, face_sets={"clamp": np.array([[0, 0]])})
    with pytest.raises(MeshError, match='no node set or face set "tpi": it has clamp, tip'):
        mesh.nodes("tpi")
    with pytest.raises(MeshError, match="it has none"):
        two_cells(element).nodes("tip")


def test_a_cell_type_that_is_no_element_is_refused_with_those_that_are() -> None:
    with pytest.raises(MeshError, match=r'cells of type "wedge" are not supported: mesh with one of hexahedron, '):
        Mesh(points=np.zeros((6, 3)), cells={"wedge": np.arange(6)[None]})


@pytest.mark.parametrize(
    ("sets", "message"),
    [
        ({"node_sets": {"tip": np.array([999])}}, 'node set "tip" names node 999, but there are'),
        ({"node_sets": {"tip": np.array([0, -1])}}, 'node set "tip" names node -1, but there are'),
        ({"cell_sets": {"pad": np.array([2])}}, 'cell set "pad" names cell 2, but there are 2, numbered from 0'),
        ({"face_sets": {"tip": np.array([[2, 0]])}}, 'face set "tip" names cell 2, but there are 2'),
        ({"face_sets": {"tip": np.array([[0, 6]])}}, 'face set "tip" names local face 6, but there are [456]'),
        ({"face_sets": {"tip": np.array([0, 1, 2])}}, r'face set "tip" has shape \(3,\)'),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_set_that_names_what_is_not_there_is_refused(element: Element, sets: Any, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        two_cells(element, **sets)


def test_a_cell_that_names_a_missing_node_or_has_too_few_is_refused(element: Element) -> None:
    n = element.n_node
    cells = np.arange(n)[None].copy()
    cells[0, -1] = n
    with pytest.raises(MeshError, match=f'a "{element.cell_type}" cell names node {n}, but there are {n}'):
        Mesh(points=element.nodes, cells={element.cell_type: cells})
    with pytest.raises(MeshError, match=rf"have shape \(1, {n - 1}\), but each must have {n} nodes"):
        Mesh(points=element.nodes, cells={element.cell_type: np.arange(n - 1)[None]})


def test_empty_sets_are_no_error(element: Element) -> None:
    nothing = np.array([], dtype=np.int64)
    mesh = two_cells(element, node_sets={"a": nothing}, cell_sets={"b": nothing}, face_sets={"c": nothing})
    assert mesh.nodes("a").size == 0


def test_elasticity_gives_the_engineering_constants_back() -> None:
    compliance = np.linalg.inv(STEEL.elasticity())
    assert 1 / compliance[0, 0] == pytest.approx(STEEL.young, rel=1e-12)
    assert -compliance[1, 0] / compliance[0, 0] == pytest.approx(STEEL.poisson, rel=1e-12)
    np.testing.assert_allclose(1 / np.diag(compliance)[3:], STEEL.young / 2 / (1 + STEEL.poisson), rtol=1e-12)
    bulk = STEEL.lame + 2 * STEEL.shear / 3
    assert bulk == pytest.approx(STEEL.young / 3 / (1 - 2 * STEEL.poisson), rel=1e-14)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"young": -1.0}, "young = -1 Pa must be positive"),
        ({"young": float("nan")}, "young = nan Pa must be positive"),
        ({"poisson": 0.5}, "poisson = 0.5 must lie between -1 and 0.5"),
        ({"poisson": -1.0}, "poisson = -1 must lie between"),
        ({"density": 0.0}, r"density = 0 kg/m\^3 must be positive"),
    ],
    ids=str,
)
def test_an_impossible_material_is_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Material(**({"young": 210e9, "poisson": 0.3, "density": 7800.0} | change))


@pytest.mark.parametrize("name", ["young", "density"])
def test_an_infinite_constant_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=f"{name} = inf"):
        Material(**({"young": 210e9, "poisson": 0.3, "density": 7800.0} | {name: float("inf")}))
