"""What a measure of cell shape must satisfy, and how a spoilt mesh is refused."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fe.element import ELEMENTS, HEX8, HEX20, TET10, Element
from fe.errors import InvertedCell
from fe.mesh import Mesh
from fe.mesh_quality import check_quality, measure_cell_quality

# Some tens of operations on numbers near one.
ROUND_OFF = 1e-13
BRICKS = pytest.mark.parametrize("element", [HEX8, HEX20], ids=lambda element: element.name)


def row_of_cells(element: Element, n: int = 3) -> Mesh:
    """Reference cells with unit sides along x, each with nodes of its own, the middle one in a cell set."""
    unit = (element.nodes - element.nodes.min(axis=0)) / np.ptp(element.nodes, axis=0)
    points = np.concatenate([unit + np.array([k, 0, 0]) for k in range(n)])
    cells = np.arange(n * element.n_node).reshape(n, -1)
    return Mesh(points=points, cells={element.cell_type: cells}, cell_sets={"middle": np.array([n // 2])})


def moved(mesh: Mesh, points: NDArray[np.float64]) -> Mesh:
    return Mesh(points=points, cells=mesh.cells, cell_sets=mesh.cell_sets)


@BRICKS
def test_a_brick_scores_one_and_has_its_volume(element: Element) -> None:
    mesh = row_of_cells(element)
    quality = measure_cell_quality(moved(mesh, mesh.points * [0.2, 0.3, 0.5]))
    np.testing.assert_allclose(quality.scaled_jacobian, 1, atol=ROUND_OFF)
    np.testing.assert_allclose(quality.determinant_ratio, 1, atol=ROUND_OFF)
    np.testing.assert_allclose(quality.volume, 0.03, rtol=ROUND_OFF)


@BRICKS
def test_a_sheared_brick_scores_the_sine_of_its_angle(element: Element) -> None:
    mesh = row_of_cells(element)
    angle = np.deg2rad(40)
    shear = np.array([[1, np.cos(angle), 0], [0, np.sin(angle), 0], [0, 0, 1]])
    quality = measure_cell_quality(moved(mesh, mesh.points @ shear.T))
    np.testing.assert_allclose(quality.scaled_jacobian, np.sin(angle), atol=ROUND_OFF)
    # The map is affine: the determinant is the same everywhere.
    np.testing.assert_allclose(quality.determinant_ratio, 1, atol=ROUND_OFF)


def test_size_and_rotation_change_nothing(element: Element) -> None:
    generator = np.random.default_rng(3)
    mesh = row_of_cells(element)
    bent = mesh.points + 0.03 * generator.standard_normal(mesh.points.shape)
    rotation, _ = np.linalg.qr(generator.standard_normal((3, 3)))
    rotation *= np.linalg.det(rotation)
    before, after = measure_cell_quality(moved(mesh, bent)), measure_cell_quality(moved(mesh, 1e-3 * bent @ rotation.T))
    np.testing.assert_allclose(after.scaled_jacobian, before.scaled_jacobian, atol=ROUND_OFF)
    np.testing.assert_allclose(after.determinant_ratio, before.determinant_ratio, atol=ROUND_OFF)


@pytest.mark.parametrize("cell_type", sorted(ELEMENTS))
def test_cells_in_many_chunks_score_as_in_one(cell_type: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = row_of_cells(ELEMENTS[cell_type], 7)
    bent = moved(mesh, mesh.points + 0.03 * np.random.default_rng(4).standard_normal(mesh.points.shape))
    whole = measure_cell_quality(bent)
    monkeypatch.setattr("fe.mesh_quality.CHUNK", 2)
    # Not bit for bit: the sum over nodes may run in another order for another chunk length.
    np.testing.assert_allclose(measure_cell_quality(bent).determinant_ratio, whole.determinant_ratio, atol=ROUND_OFF)


def test_the_inverted_cell_is_named_by_file_type_set_and_number(element: Element) -> None:
    mesh = row_of_cells(element)
    points = mesh.points.copy()
    # The last corner of the first face's far side is pushed through that face.
    points[element.n_node + element.n_corner - 1 - (element.n_corner == 8)] = [0.5, -1, -1]
    named = rf'blade.inp, {element.cell_type} cells of cell set "middle": 1 of 3 .*cell 1;'
    with pytest.raises(InvertedCell, match=named):
        check_quality(moved(mesh, points), source="blade.inp")
    with pytest.raises(InvertedCell, match=r"cell 1002;.*remesh that region"):
        check_quality(moved(mesh, points), labels=np.array([1001, 1002, 1003]))


def test_only_the_first_numbers_are_listed_and_the_rest_counted() -> None:
    mesh = row_of_cells(HEX8, 40)
    with pytest.raises(InvertedCell, match=r"40 of 40 .*cells 0, 1, 2, 3, 4, 5, 6, 7, \.\.\.;.*all are mirrored"):
        check_quality(moved(mesh, mesh.points * [1, 1, -1]))


def test_a_midside_node_alone_can_fold_a_cell() -> None:
    mesh = row_of_cells(HEX20)
    points = mesh.points.copy()
    # Beyond the quarter point the map of an edge, x = xi/2 + a (1 - xi^2), loses its monotony.
    points[8] = [0.8, 0, 0]
    assert measure_cell_quality(moved(mesh, points)).scaled_jacobian.min() == pytest.approx(1)
    with pytest.raises(InvertedCell, match=r"cell 0;.*move the midside nodes back"):
        check_quality(moved(mesh, points))


def test_a_collapsed_cell_is_refused(element: Element) -> None:
    mesh = row_of_cells(element)
    with pytest.raises(InvertedCell, match="3 of 3"):
        check_quality(moved(mesh, mesh.points * [1, 1, 0]))


def test_a_sound_mesh_passes_with_its_quality(element: Element) -> None:
    assert check_quality(row_of_cells(element)).volume.sum() == pytest.approx(
        3 * element.rule[1].sum() / np.ptp(element.nodes, axis=0).prod()
    )


def test_a_regular_tetrahedron_scores_one_and_one_between_three_edges_the_root_of_a_half() -> None:
    corners = np.array([[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]], dtype=float)
    regular = Mesh(points=TET10.corner_shape(TET10.nodes) @ corners, cells={"tetra10": np.arange(10)[None]})
    quality = measure_cell_quality(regular)
    np.testing.assert_allclose(quality.scaled_jacobian, 1, atol=ROUND_OFF)
    np.testing.assert_allclose(quality.volume, 8 / 3, rtol=ROUND_OFF)  # a third of the cube around it
    # At the far ends of the three edges the unit vectors span 1/2.
    np.testing.assert_allclose(measure_cell_quality(row_of_cells(TET10)).scaled_jacobian, np.sqrt(0.5), atol=ROUND_OFF)


def test_the_determinant_of_a_curved_tetrahedron_is_that_of_its_edge() -> None:
    mesh = row_of_cells(TET10, 1)
    points = mesh.points.copy()
    # An edge x = xi + 4 a xi (1 - xi): at xi = 1 its slope is 1 - 4 a, and so is the determinant.
    points[4] += [0.2, 0, 0]
    quality = measure_cell_quality(moved(mesh, points))
    volume = quality.volume[0]
    assert quality.determinant_ratio[0] * 6 * volume == pytest.approx(1 - 0.8, rel=1e-12)
    assert quality.scaled_jacobian[0] == pytest.approx(np.sqrt(0.5))
    points[4] += [0.1, 0, 0]
    with pytest.raises(InvertedCell, match=r"tetra10 cells.*cell 0;.*move the midside nodes back"):
        check_quality(moved(mesh, points))


def test_a_mesh_without_cells_has_no_bad_cell() -> None:
    assert check_quality(Mesh(points=np.zeros((0, 3)), cells={})).volume.size == 0
