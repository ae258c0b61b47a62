"""Recovered stresses against states and beams whose stresses are known."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX8, HEX20, Element
from fe.errors import MeshError
from fe.material import STEEL, Material
from fe.mesh import Mesh
from fe.sparse.solver import factorise
from fe.stress import compute_nodal_stress, compute_strain, compute_stress, compute_von_mises

BoxMesher = Callable[..., Mesh]


@pytest.mark.parametrize(
    ("tensor", "expected"),
    [
        ([-7, 0, 0, 0, 0, 0], 7),
        ([0, 0, 0, 0, 2, 0], 2 * np.sqrt(3)),
        ([5, 5, 5, 0, 0, 0], 0),
        ([3, 3, 0, 0, 0, 0], 3),
        ([4, -4, 0, 0, 0, 0], 4 * np.sqrt(3)),
    ],
    ids=["uniaxial", "shear", "hydrostatic", "equibiaxial", "shear by its principal stresses"],
)
def test_von_mises_stress_of_known_states(tensor: list[float], expected: float) -> None:
    assert compute_von_mises(np.array(tensor, dtype=float)) == pytest.approx(expected, abs=1e-14)


def as_matrix(tensor: NDArray[np.float64]) -> NDArray[np.float64]:
    xx, yy, zz, xy, yz, zx = tensor
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


@given(seed=st.integers(0, 2**32 - 1), pressure=st.floats(-10, 10))
def test_von_mises_stress_sees_neither_rotation_nor_pressure(seed: int, pressure: float) -> None:
    generator = np.random.default_rng(seed)
    tensor = generator.standard_normal(6)
    rotation, _ = np.linalg.qr(generator.standard_normal((3, 3)))
    turned = rotation @ as_matrix(tensor) @ rotation.T + pressure * np.eye(3)
    other = np.array([*np.diag(turned), turned[0, 1], turned[1, 2], turned[2, 0]])
    # The pressure cancels in differences of numbers up to ten.
    assert compute_von_mises(other) == pytest.approx(compute_von_mises(tensor), rel=1e-10, abs=1e-13)


def test_a_rotation_is_no_strain(element: Element, box: BoxMesher) -> None:
    mesh = box(element, distortion=0.2, bow=0.1)
    spin = np.cross([0.3, -0.2, 0.5], mesh.points)
    np.testing.assert_allclose(compute_strain(mesh, spin, element.nodes), 0, atol=1e-13)


def test_each_component_of_strain_is_that_of_its_displacement(box: BoxMesher) -> None:
    mesh = box(HEX8)
    x, y, z = mesh.points.T
    zero = np.zeros_like(x)
    fields = [(x, zero, zero), (zero, y, zero), (zero, zero, z), (y, zero, zero), (zero, z, zero), (zero, zero, x)]
    for row, field in enumerate(fields):
        result = compute_strain(mesh, np.stack(field, axis=1), HEX8.rule[0])
        np.testing.assert_allclose(result, np.broadcast_to(np.eye(6)[row], result.shape), atol=1e-13)


def test_the_work_of_the_stress_is_the_strain_energy(element: Element, box: BoxMesher) -> None:
    mesh = box(element, distortion=0.2, bow=0.1)
    displacement = np.random.default_rng(2).standard_normal((mesh.n_node, 3))
    materials = {"low": STEEL, "high": Material(young=70e9, poisson=0.33, density=2700.0)}
    at, weights = element.rule
    (cells,) = mesh.cells.values()
    J = np.einsum("eai,qaj->eqij", mesh.points[cells], element.gradient(at))
    work = compute_stress(mesh, materials, displacement, at) * compute_strain(mesh, displacement, at)
    _, stiffness = assemble(mesh, materials)
    expected = displacement.ravel() @ stiffness @ displacement.ravel()
    assert (work.sum(axis=2) * np.linalg.det(J) * weights).sum() == pytest.approx(expected, rel=1e-11)


def test_a_linear_stress_goes_from_gauss_points_to_nodes_of_a_brick_unchanged(element: Element, box: BoxMesher) -> None:
    mesh = box(element, counts=(2, 2, 2))
    x, y, z = mesh.points.T
    # eps_xx = y + z and nothing but shears beside it: bilinear displacement, held by every element here.
    displacement = np.stack([x * (y + z), 0 * y, 0 * z], axis=1)
    result = compute_nodal_stress(mesh, STEEL, displacement)
    np.testing.assert_allclose(result[:, 1], STEEL.lame * (y + z), atol=1e-13 * STEEL.lame)


def test_the_stress_of_a_bent_cantilever_is_that_of_beam_theory(box: BoxMesher) -> None:
    length, width, height, force = 0.2, 0.01, 0.02, 100.0
    mesh = box(HEX20, counts=(20, 2, 4), size=(length, width, height))
    system = supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("x0"))])
    tip = mesh.nodes("x1")
    load = np.zeros(system.n_dof)
    load[system.rows(tip, (2,))] = force / len(tip)
    displacement = system.on_mesh(factorise(system.stiffness).solve(load)[:, None])[:, :, 0]
    result = compute_nodal_stress(mesh, STEEL, displacement)
    x, _, z = mesh.points.T
    # Two heights away from both ends how the load is applied no longer matters (Saint-Venant).
    inside = (x > 2 * height) & (x < length - 2 * height)
    inertia = width * height**3 / 12
    bending = -force * (length - x) * (z - height / 2) / inertia
    peak = np.abs(bending).max()
    np.testing.assert_allclose(result[inside, 0], bending[inside], atol=1e-3 * peak)
    neutral = inside & (np.abs(z - height / 2) < 1e-9)
    middle = neutral & (np.abs(mesh.points[:, 1] - width / 2) < 1e-9)
    # The parabola's crest is 3/2 of the mean; four cells cut it a little, and a narrow section varies across (2 %).
    assert result[middle, 5].mean() == pytest.approx(1.5 * force / (width * height), rel=0.05)
    np.testing.assert_allclose(result[inside][:, [1, 2, 3, 4]], 0, atol=0.02 * peak)


def test_blocks_of_both_types_keep_their_own_cells(box: BoxMesher) -> None:
    linear, quadratic = box(HEX8, counts=(2, 1, 1)), box(HEX20, counts=(1, 2, 1))
    points = np.concatenate([linear.points, quadratic.points + np.array([2, 0, 0])])
    cells = {"hexahedron": linear.cells["hexahedron"], "hexahedron20": quadratic.cells["hexahedron20"] + linear.n_node}
    soft = Material(young=1.0, poisson=0.0, density=1.0)
    hard = Material(young=5.0, poisson=0.0, density=1.0)
    mesh = Mesh(points=points, cells=cells, cell_sets={"soft": np.array([0, 1]), "hard": np.array([2, 3])})
    stretch = points * [1e-3, 0, 0]
    sampled = compute_stress(mesh, {"soft": soft, "hard": hard}, stretch)
    np.testing.assert_allclose(sampled[:2, :, 0], 1e-3, rtol=1e-12)
    np.testing.assert_allclose(sampled[2:, :, 0], 5e-3, rtol=1e-12)
    nodal = compute_nodal_stress(mesh, {"soft": soft, "hard": hard}, stretch)
    np.testing.assert_allclose(nodal[:, 0], np.where(points[:, 0] < 1.5, 1e-3, 5e-3), rtol=1e-12)


def test_at_an_interface_of_materials_the_nodal_stress_is_the_mean_of_both_sides(box: BoxMesher) -> None:
    mesh = box(HEX8, counts=(2, 1, 1))
    materials = {name: Material(young=young, poisson=0.0, density=1.0) for name, young in (("low", 1.0), ("high", 3.0))}
    result = compute_nodal_stress(mesh, materials, mesh.points * [1.0, 0, 0])[:, 0]
    by_place = {0.0: 1.0, 0.5: 2.0, 1.0: 3.0}
    np.testing.assert_allclose(result, [by_place[round(float(x), 9)] for x in mesh.points[:, 0]], rtol=1e-13)


def test_stress_of_cells_without_material_is_refused(box: BoxMesher) -> None:
    mesh = box(HEX8)
    with pytest.raises(MeshError, match="14 cells have no material"):
        compute_nodal_stress(mesh, {"low": STEEL}, np.zeros((mesh.n_node, 3)))
