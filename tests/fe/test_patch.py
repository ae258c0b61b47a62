"""Patch tests: a body of distorted cells reproduces the polynomial fields that its elements hold, exactly."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.element import ELEMENTS, HEX8, HEX20, TET10, Element
from fe.material import STEEL
from fe.mesh import Mesh
from fe.sparse.solver import factorise
from fe.stress import compute_nodal_stress, compute_strain, compute_stress

BoxMesher = Callable[..., Mesh]
# Round-off times the condition number of the free block, about 1e3 for these few cells.
EXACT = 1e-12


def boundary_nodes(mesh: Mesh) -> NDArray[np.int64]:
    return np.unique(np.concatenate([mesh.nodes(wall) for wall in mesh.face_sets]))


def with_walls_moved(mesh: Mesh, field: NDArray[np.float64]) -> NDArray[np.float64]:
    """Displacement in equilibrium without loads inside when all wall nodes follow a field (n_node, 3)."""
    _, stiffness = assemble(mesh, STEEL)
    moved = np.zeros(mesh.n_node, dtype=bool)
    moved[boundary_nodes(mesh)] = True
    free, fixed = (np.flatnonzero(np.repeat(which, 3)) for which in (~moved, moved))
    solution = field.ravel().copy()
    load = -stiffness[free][:, fixed] @ solution[fixed]
    solution[free] = factorise(sp.csr_array(stiffness[free][:, free])).solve(load)
    return np.asarray(solution.reshape(-1, 3))


GRADIENT = np.array([[1.0, -0.4, 0.3], [0.7, -0.6, 0.2], [-0.1, 0.5, 0.8]]) * 1e-3
STRAIN = np.array(
    [
        *np.diag(GRADIENT),
        GRADIENT[0, 1] + GRADIENT[1, 0],
        GRADIENT[1, 2] + GRADIENT[2, 1],
        GRADIENT[2, 0] + GRADIENT[0, 2],
    ]
)


@pytest.mark.parametrize("bow", [0.0, 0.1], ids=["straight edges", "curved edges"])
def test_constant_strain_is_exact_on_distorted_cells(element: Element, box: BoxMesher, bow: float) -> None:
    mesh = box(element, distortion=0.2, bow=bow if element.n_corner == 8 else 0.0, seed=7)
    assert len(boundary_nodes(mesh)) < mesh.n_node  # else nothing is solved for
    field = mesh.points @ GRADIENT.T
    displacement = with_walls_moved(mesh, field)
    np.testing.assert_allclose(displacement, field, atol=EXACT * np.abs(field).max())
    gauss = compute_strain(mesh, displacement, element.rule[0])
    np.testing.assert_allclose(gauss, np.broadcast_to(STRAIN, gauss.shape), atol=100 * EXACT * np.abs(STRAIN).max())


def test_constant_stress_is_exact_at_gauss_points_and_nodes_of_distorted_cells(
    element: Element, box: BoxMesher
) -> None:
    mesh = box(element, distortion=0.2, bow=0.1 if element.n_corner == 8 else 0.0, seed=8)
    displacement = with_walls_moved(mesh, mesh.points @ GRADIENT.T)
    expected = STEEL.elasticity() @ STRAIN
    # Differences of displacements over a cell lose one digit more than the displacements.
    tolerance = 100 * EXACT * np.abs(expected).max()
    for result in (compute_stress(mesh, STEEL, displacement), compute_stress(mesh, STEEL, displacement, element.nodes)):
        np.testing.assert_allclose(result, np.broadcast_to(expected, result.shape), atol=tolerance)
    nodal = compute_nodal_stress(mesh, STEEL, displacement)
    np.testing.assert_allclose(nodal, np.broadcast_to(expected, nodal.shape), atol=tolerance)


def test_curved_tetrahedra_miss_constant_strain_by_the_square_of_the_bow(box: BoxMesher) -> None:
    # On curved cells the integrand is a cubic, one degree above what the 4-point rule of C3D10 holds.
    def error(bow: float) -> float:
        mesh = box(TET10, distortion=0.2, bow=bow, seed=7)
        field = mesh.points @ GRADIENT.T
        return float(np.abs(with_walls_moved(mesh, field) - field).max() / np.abs(field).max())

    bows = (0.1, 0.05)
    coarse, fine = (error(bow) for bow in bows)
    assert coarse < 1e-3
    # The next term, cubic in the bow, moves the order by a few tenths at these sizes.
    assert np.log2(coarse / fine) == pytest.approx(2, abs=0.3)


def bending(points: NDArray[np.float64], curvature: float = 0.01) -> NDArray[np.float64]:
    """Pure bending about y with its anticlastic curvature: the only stress is E curvature z along x."""
    x, y, z = points.T
    nu = STEEL.poisson
    return np.stack([curvature * x * z, -nu * curvature * y * z, -curvature / 2 * (x**2 + nu * (z**2 - y**2))], axis=1)


def sheared(mesh: Mesh) -> Mesh:
    """An affine image of a box: every cell a parallelepiped."""
    map_ = np.array([[1.0, 0.3, -0.2], [0.1, 0.9, 0.25], [-0.15, 0.2, 1.1]])
    return Mesh(points=mesh.points @ map_.T, cells=mesh.cells, face_sets=mesh.face_sets)


@pytest.mark.parametrize(
    "element", [each for each in ELEMENTS.values() if each.degree >= 2], ids=lambda element: element.name
)
def test_pure_bending_is_exact_for_quadratic_elements_on_affine_cells(element: Element, box: BoxMesher) -> None:
    mesh = sheared(box(element))
    field = bending(mesh.points)
    displacement = with_walls_moved(mesh, field)
    np.testing.assert_allclose(displacement, field, atol=EXACT * np.abs(field).max())
    # The stress is linear, so that its extrapolation from the Gauss points to the nodes is exact too.
    expected = np.zeros((mesh.n_node, 6))
    expected[:, 0] = STEEL.young * 0.01 * mesh.points[:, 2]
    nodal = compute_nodal_stress(mesh, STEEL, displacement)
    np.testing.assert_allclose(nodal, expected, atol=100 * EXACT * np.abs(expected).max())


def test_pure_bending_is_lost_where_the_cells_are_not_affine(box: BoxMesher) -> None:
    mesh = box(HEX20, distortion=0.2, seed=7)
    field = bending(mesh.points)
    error = np.abs(with_walls_moved(mesh, field) - field).max() / np.abs(field).max()
    # The serendipity space lacks the products that a quadratic becomes under a trilinear map: small, but no round-off.
    assert 1e-6 < error < 1e-2


def test_the_linear_brick_answers_bending_with_the_parasitic_shear_of_theory(box: BoxMesher) -> None:
    n, curvature = 3, 0.01
    mesh = box(HEX8, counts=(n, n, n), size=(1.0, 0.8, 0.6))
    # Its edges stay straight, so that u_z lacks the parabola in x: gamma_zx = curvature (x - x_middle of the cell).
    shear = compute_strain(mesh, bending(mesh.points, curvature), HEX8.rule[0])[..., 5]
    expected = curvature * (1.0 / n) / 2 * HEX8.rule[0][:, 0]
    np.testing.assert_allclose(shear, np.broadcast_to(expected, shear.shape), atol=EXACT)
