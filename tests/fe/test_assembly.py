"""Assembled mass and stiffness: the same as a slow loop's, exactly symmetric, and of the right total."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import fe.assembly
from fe.assembly import assemble
from fe.boundary import make_rigid_motions
from fe.element import ELEMENTS, HEX8, HEX20, Element
from fe.errors import InvertedCell, MeshError
from fe.material import STEEL, Material
from fe.mesh import Mesh

BoxMesher = Callable[..., Mesh]
ALUMINIUM = Material(young=70e9, poisson=0.33, density=2700.0)
TWO = {"low": STEEL, "high": ALUMINIUM}
SIZE = (0.05, 0.04, 0.03)


def slow(mesh: Mesh, materials: dict[str, Material]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One cell, one Gauss point, one pair of nodes after the other, into dense matrices."""
    mass, stiffness = np.zeros((2, 3 * mesh.n_node, 3 * mesh.n_node))
    material_of = {int(cell): material for name, material in materials.items() for cell in mesh.cell_sets[name]}
    number = -1
    for cell_type, cells in mesh.cells.items():
        element = ELEMENTS[cell_type]
        at, weights = element.rule
        shape, reference = element.shape(at), element.gradient(at)
        for nodes in cells:
            number += 1
            material = material_of[number]
            C = material.elasticity()
            for N, dN, weight in zip(shape, reference, weights, strict=True):
                jacobian = mesh.points[nodes].T @ dN
                slope = np.linalg.solve(jacobian.T, dN.T).T
                volume = weight * np.linalg.det(jacobian)
                strains = [_strain_matrix(one) for one in slope]
                for a, node_a in enumerate(nodes):
                    for b, node_b in enumerate(nodes):
                        rows, columns = slice(3 * node_a, 3 * node_a + 3), slice(3 * node_b, 3 * node_b + 3)
                        stiffness[rows, columns] += volume * strains[a].T @ C @ strains[b]
                        mass[rows, columns] += volume * material.density * N[a] * N[b] * np.eye(3)
    return mass, stiffness


def _strain_matrix(slope: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y, z = slope
    return np.array([[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]])


def close(found: NDArray[np.float64], expected: NDArray[np.float64]) -> None:
    # Sums of some hundred products; entries that cancel are measured against the largest.
    np.testing.assert_allclose(found, expected, atol=1e-13 * np.abs(expected).max(), rtol=0)


def test_it_agrees_with_a_slow_loop_on_distorted_cells_of_two_materials(element: Element, box: BoxMesher) -> None:
    mesh = box(element, counts=(2, 2, 1), size=SIZE, distortion=0.2, bow=0.1)
    mass, stiffness = assemble(mesh, TWO)
    slow_mass, slow_stiffness = slow(mesh, TWO)
    close(mass.toarray(), slow_mass)
    close(stiffness.toarray(), slow_stiffness)


def test_cells_of_different_types_share_one_mesh(box: BoxMesher) -> None:
    linear, quadratic = box(HEX8, counts=(2, 1, 1), size=SIZE), box(HEX20, counts=(1, 2, 1), size=SIZE)
    points = np.concatenate([linear.points, quadratic.points + np.array([1, 0, 0])])
    cells = {"hexahedron": linear.cells["hexahedron"], "hexahedron20": quadratic.cells["hexahedron20"] + linear.n_node}
    # Cell 2 is the first of the second block.
    mesh = Mesh(points=points, cells=cells, cell_sets={"low": np.array([0, 3]), "high": np.array([1, 2])})
    mass, stiffness = assemble(mesh, TWO)
    slow_mass, slow_stiffness = slow(mesh, TWO)
    close(mass.toarray(), slow_mass)
    close(stiffness.toarray(), slow_stiffness)


def test_both_matrices_are_symmetric_to_the_last_bit(
    element: Element, box: BoxMesher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fe.assembly, "BATCH", 5)  # so that neighbours meet in different batches
    for matrix in assemble(box(element, counts=(4, 3, 2), distortion=0.2, bow=0.1), TWO):
        assert abs(matrix - matrix.T).max() == 0


def test_each_entry_is_stored_once_and_in_the_order_of_its_column(
    element: Element, box: BoxMesher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fe.assembly, "BATCH", 5)  # so that a pair of nodes comes from several batches
    for matrix in assemble(box(element), STEEL):
        row = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
        place = row * matrix.shape[0] + matrix.indices
        assert (np.diff(place) > 0).all()


def test_the_mass_of_a_box_is_density_times_volume_in_each_direction(element: Element, box: BoxMesher) -> None:
    # The volume of a curved tetrahedron is the integral of a cubic, which its 4-point rule does not hold.
    bow = 0.1 if element.n_corner == 8 else 0.0
    mass, _ = assemble(box(element, size=SIZE, distortion=0.25, bow=bow, seed=2), STEEL)
    expected = STEEL.density * np.prod(SIZE)
    for axis in range(3):
        moving = np.zeros(mass.shape[0])
        moving[axis::3] = 1
        # Each cell's volume is a polynomial that its rule integrates exactly.
        assert moving @ mass @ moving == pytest.approx(expected, rel=1e-13)
        assert np.roll(moving, 1) @ mass @ moving == 0


def test_the_moment_of_inertia_of_a_box_is_the_closed_form(element: Element, box: BoxMesher) -> None:
    mesh = box(element, size=SIZE)
    mass, _ = assemble(mesh, STEEL)
    centre = np.array(SIZE) / 2
    spin = np.cross([0, 0, 1], mesh.points - centre).ravel()
    # A rotation is a linear field, so it is interpolated, and on bricks integrated, exactly.
    expected = STEEL.density * np.prod(SIZE) * (SIZE[0] ** 2 + SIZE[1] ** 2) / 12
    assert spin @ mass @ spin == pytest.approx(expected, rel=1e-13)


def test_rigid_motions_of_the_whole_body_meet_no_force(element: Element, box: BoxMesher) -> None:
    mesh = box(element, distortion=0.25, bow=0.1)
    _, stiffness = assemble(mesh, TWO)
    forces = stiffness @ make_rigid_motions(mesh.points).reshape(-1, 6)
    np.testing.assert_allclose(forces, 0, atol=1e-13 * stiffness.diagonal().max())


def test_the_order_of_the_cells_changes_round_off_alone(
    element: Element, box: BoxMesher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fe.assembly, "BATCH", 4)
    mesh = box(element, distortion=0.2)
    order = np.random.default_rng(1).permutation(mesh.n_cell)
    (cell_type, cells), *_ = mesh.cells.items()
    place = np.argsort(order)
    shuffled = replace(
        mesh,
        cells={cell_type: cells[order]},
        face_sets={},
        cell_sets={name: place[members] for name, members in mesh.cell_sets.items()},
    )
    for matrix, other in zip(assemble(mesh, TWO), assemble(shuffled, TWO), strict=True):
        assert abs(matrix - other).max() < 1e-14 * abs(matrix).max()


def test_one_material_for_all_is_that_material_in_every_set(box: BoxMesher) -> None:
    mesh = box(HEX8)
    for whole, parts in zip(assemble(mesh, STEEL), assemble(mesh, {"low": STEEL, "high": STEEL}), strict=True):
        assert abs(whole - parts).max() == 0


def test_a_cell_without_material_is_counted_and_numbered(box: BoxMesher) -> None:
    with pytest.raises(MeshError, match="14 cells have no material, the first is cell 13"):
        assemble(box(HEX8), {"low": STEEL})


def test_a_cell_with_two_materials_is_named(box: BoxMesher) -> None:
    mesh = replace(box(HEX8), cell_sets={"low": np.arange(20), "high": np.arange(15, 27)})
    with pytest.raises(MeshError, match='cell 15 has two materials: "high" shares it'):
        assemble(mesh, TWO)


def test_a_material_for_an_unknown_set_shows_the_sets_there_are(box: BoxMesher) -> None:
    with pytest.raises(MeshError, match='cell set "pad", but the mesh has high, low'):
        assemble(box(HEX8), {**TWO, "pad": STEEL})


def test_an_inverted_cell_is_refused_by_its_number_in_the_mesh(
    element: Element, box: BoxMesher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fe.assembly, "BATCH", 5)
    mesh = box(element)
    points = mesh.points.copy()
    (cells,) = mesh.cells.values()
    # The far corner of the box goes through the opposite sides of the cells on it, the first of which is named.
    far = points.sum(axis=1).argmax()
    points[far] -= 0.9
    first = np.flatnonzero((cells == far).any(axis=1))[0]
    assert first >= 26
    with pytest.raises(InvertedCell, match=f"{element.name} cell {first} is inverted"):
        assemble(replace(mesh, points=points), STEEL)


def test_a_mesh_without_cells_is_refused() -> None:
    with pytest.raises(MeshError, match="the mesh has no cells"):
        assemble(Mesh(points=np.zeros((3, 3)), cells={}), STEEL)
