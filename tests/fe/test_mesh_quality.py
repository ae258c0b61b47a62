"""What a measure of cell shape must satisfy, and how a spoilt mesh is refused."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fe.element import ELEMENTS, HEX8, HEX20, Element
from fe.errors import InvertedCell
from fe.mesh import Mesh
from fe.mesh_quality import cell_quality, check_quality

# Some tens of operations on numbers near one.
ROUND_OFF = 1e-13
BOTH = pytest.mark.parametrize("element", [HEX8, HEX20], ids=lambda element: element.name)


def row_of_cells(element: Element, n: int = 3) -> Mesh:
    """Unit cubes side by side along x, each with nodes of its own, the middle one in a cell set."""
    points = np.concatenate([(element.nodes + 1) / 2 + [k, 0, 0] for k in range(n)])
    cells = np.arange(n * element.n_node).reshape(n, -1)
    return Mesh(points=points, cells={element.cell_type: cells}, cell_sets={"middle": np.array([n // 2])})


def moved(mesh: Mesh, points: NDArray[np.float64]) -> Mesh:
    return Mesh(points=points, cells=mesh.cells, cell_sets=mesh.cell_sets)


@BOTH
def test_a_brick_scores_one_and_has_its_volume(element: Element) -> None:
    mesh = row_of_cells(element)
    quality = cell_quality(moved(mesh, mesh.points * [0.2, 0.3, 0.5]))
    np.testing.assert_allclose(quality.scaled_jacobian, 1, atol=ROUND_OFF)
    np.testing.assert_allclose(quality.determinant_ratio, 1, atol=ROUND_OFF)
    np.testing.assert_allclose(quality.volume, 0.03, rtol=ROUND_OFF)


@BOTH
def test_a_sheared_brick_scores_the_sine_of_its_angle(element: Element) -> None:
    mesh = row_of_cells(element)
    angle = np.deg2rad(40)
    shear = np.array([[1, np.cos(angle), 0], [0, np.sin(angle), 0], [0, 0, 1]])
    quality = cell_quality(moved(mesh, mesh.points @ shear.T))
    np.testing.assert_allclose(quality.scaled_jacobian, np.sin(angle), atol=ROUND_OFF)
    # The map is affine: the determinant is the same everywhere.
    np.testing.assert_allclose(quality.determinant_ratio, 1, atol=ROUND_OFF)


@BOTH
def test_size_and_rotation_change_nothing(element: Element) -> None:
    generator = np.random.default_rng(3)
    mesh = row_of_cells(element)
    bent = mesh.points + 0.03 * generator.standard_normal(mesh.points.shape)
    rotation, _ = np.linalg.qr(generator.standard_normal((3, 3)))
    rotation *= np.linalg.det(rotation)
    before, after = cell_quality(moved(mesh, bent)), cell_quality(moved(mesh, 1e-3 * bent @ rotation.T))
    np.testing.assert_allclose(after.scaled_jacobian, before.scaled_jacobian, atol=ROUND_OFF)
    np.testing.assert_allclose(after.determinant_ratio, before.determinant_ratio, atol=ROUND_OFF)


@pytest.mark.parametrize("cell_type", sorted(ELEMENTS))
def test_cells_in_many_chunks_score_as_in_one(cell_type: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = row_of_cells(ELEMENTS[cell_type], 7)
    bent = moved(mesh, mesh.points + 0.03 * np.random.default_rng(4).standard_normal(mesh.points.shape))
    whole = cell_quality(bent)
    monkeypatch.setattr("fe.mesh_quality.CHUNK", 2)
    # Not bit for bit: the sum over nodes may run in another order for another chunk length.
    np.testing.assert_allclose(cell_quality(bent).determinant_ratio, whole.determinant_ratio, atol=ROUND_OFF)


@BOTH
def test_the_inverted_cell_is_named_by_file_type_set_and_number(element: Element) -> None:
    mesh = row_of_cells(element)
    points = mesh.points.copy()
    # Corner 6 of the middle cell is pushed through the opposite corner.
    points[element.n_node + 6] = [0.5, -1, -1]
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
    assert cell_quality(moved(mesh, points)).scaled_jacobian.min() == pytest.approx(1)
    with pytest.raises(InvertedCell, match=r"cell 0;.*move the midside nodes back"):
        check_quality(moved(mesh, points))


@BOTH
def test_a_collapsed_cell_is_refused(element: Element) -> None:
    mesh = row_of_cells(element)
    with pytest.raises(InvertedCell, match="3 of 3"):
        check_quality(moved(mesh, mesh.points * [1, 1, 0]))


@BOTH
def test_a_sound_mesh_passes_with_its_quality(element: Element) -> None:
    assert check_quality(row_of_cells(element)).volume.sum() == pytest.approx(3)


def test_a_mesh_without_cells_has_no_bad_cell() -> None:
    assert check_quality(Mesh(points=np.zeros((0, 3)), cells={})).volume.size == 0
