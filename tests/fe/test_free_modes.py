"""A body that nothing holds: six motions at no frequency, then its elastic modes, in any unit of size."""

from collections.abc import Callable
from math import pi, sqrt

import numpy as np
import pytest
import scipy.linalg

from fe.assembly import assemble
from fe.boundary import make_rigid_motions
from fe.element import HEX8, HEX20, Element
from fe.material import STEEL, Material
from fe.mesh import Mesh
from fe.modal import ModeSet, compute_free_modes
from fe.system import LinearSystem

BoxMesher = Callable[..., Mesh]
#: beta L of the first two modes of a free-free beam (Blevins, Formulas for Natural Frequency, table 8-1).
FREE_FREE = (4.73004074, 7.85320462)


def free_system(mesh: Mesh, material: Material = STEEL) -> LinearSystem:
    mass, stiffness = assemble(mesh, material)
    n_dof = 3 * mesh.n_node
    return LinearSystem(mass=mass, damping=0 * mass, stiffness=stiffness, free=np.arange(n_dof), n_node=mesh.n_node)


def free(mesh: Mesh, n_mode: int, material: Material = STEEL) -> ModeSet:
    return compute_free_modes(free_system(mesh, material), mesh, material, n_mode)


@pytest.mark.parametrize("element", [HEX8, HEX20], ids=lambda element: element.name)
def test_six_motions_are_rigid_and_the_others_those_of_a_dense_solve(box: BoxMesher, element: Element) -> None:
    mesh = box(element, counts=(2, 2, 3), distortion=0.2)
    system = free_system(mesh)
    result = compute_free_modes(system, mesh, STEEL, 12)
    dense = scipy.linalg.eigh(system.stiffness.toarray(), system.mass.toarray(), eigvals_only=True)[:12]
    np.testing.assert_array_equal(result.frequency[:6], 0.0)
    # Taking the shift off loses its ratio to the squared frequency in digits: 1e-16 (1e-16 to 1e-12 of a cube).
    np.testing.assert_allclose(result.angular_frequency[6:], np.sqrt(dense[6:]), rtol=1e-9)
    np.testing.assert_allclose(result.damping_ratio, 0.0)
    rigid = make_rigid_motions(mesh.points).reshape(-1, 6)
    left = result.mode_shapes[:, :6] - rigid @ np.linalg.lstsq(rigid, result.mode_shapes[:, :6])[0]
    # Shapes of one eigenvalue among elastic ones that lie 1e4 times higher: round-off, and no strain.
    assert np.abs(left).max() < 1e-8 * np.abs(result.mode_shapes).max()


@pytest.mark.parametrize("scale", [1e-4, 1e-2, 1.0, 1e2, 1e4])
def test_frequency_times_size_is_the_same_from_tenths_of_millimetres_to_ten_kilometres(
    box: BoxMesher, scale: float
) -> None:
    size = np.array((1.0, 0.1, 0.05))
    reference = free(box(HEX20, counts=(8, 1, 1), size=tuple(size)), 9).frequency
    result = free(box(HEX20, counts=(8, 1, 1), size=tuple(scale * size)), 9).frequency
    np.testing.assert_array_equal(result[:6], 0.0)
    # Scaling by powers of ten rounds each entry of the matrices; a bar this slender loses three or four digits more.
    np.testing.assert_allclose(result[6:] * scale, reference[6:], rtol=1e-9)


def test_a_soft_heavy_body_has_its_six_rigid_motions_too(box: BoxMesher) -> None:
    rubber = Material(young=1e5, poisson=0.45, density=1100.0)
    assert (free(box(HEX20, counts=(3, 2, 2)), 8, rubber).frequency > 0).tolist() == [False] * 6 + [True] * 2


def test_a_slender_bar_bends_as_a_free_beam(box: BoxMesher) -> None:
    # The most slender body that the shift must tell from rigid: a hundred times as long as thick.
    length, width, thickness = 1.0, 0.02, 0.01
    result = free(box(HEX20, counts=(40, 1, 1), size=(length, width, thickness)), 9)
    np.testing.assert_array_equal(result.frequency[:6], 0.0)
    speed = sqrt(STEEL.young * thickness**2 / (12 * STEEL.density))
    first, second = (beta**2 / (2 * pi * length**2) * speed for beta in FREE_FREE)
    expected = [first, first * width / thickness, second]  # the middle one bends edgewise
    # Shear and rotatory inertia take (beta t / L)^2 (1 + E / (k G)) / 24 = 4e-4 and 1e-3 off; the sides add 1e-4.
    np.testing.assert_allclose(result.frequency[6:], expected, rtol=2e-3)


def test_a_body_on_a_hinge_keeps_one_motion_at_no_frequency(box: BoxMesher) -> None:
    mesh = box(HEX8, counts=(4, 2, 2), size=(1.0, 0.2, 0.2))
    system = free_system(mesh)
    on_axis = (np.abs(mesh.points[:, 0]) < 1e-9) & (np.abs(mesh.points[:, 1]) < 1e-9)  # along z
    kept = np.flatnonzero(~np.repeat(on_axis, 3))
    hinged = LinearSystem(
        mass=system.mass[kept][:, kept],
        damping=system.damping[kept][:, kept],
        stiffness=system.stiffness[kept][:, kept],
        free=kept,
        n_node=mesh.n_node,
    )
    assert (compute_free_modes(hinged, mesh, STEEL, 4).frequency > 0).tolist() == [False, True, True, True]
