"""Modes against closed forms, and what they must satisfy whatever solves for them."""

from collections.abc import Callable
from math import pi, sqrt

import numpy as np
import pytest
from numpy.typing import NDArray

import fe.modal
from fe.assembly import assemble
from fe.boundary import GroundedSpring, Support, supported_system
from fe.element import HEX8, HEX20
from fe.errors import SupportError
from fe.mac import modal_assurance_criterion
from fe.material import STEEL, Material
from fe.mesh import Mesh
from fe.modal import modes
from fe.sparse.solver import Backend, Definiteness, factorise, is_available
from fe.system import LinearSystem
from geometry.errors import InputError

BoxMesher = Callable[..., Mesh]
#: Without lateral contraction a beam's section stays as it is, as beam theory has it.
NO_CONTRACTION = Material(young=210e9, poisson=0.0, density=7800.0)


def cantilever(box: BoxMesher, counts: tuple[int, int, int] = (12, 3, 2)) -> LinearSystem:
    """A stout bar of quadratic cells clamped at x = 0: some 1,500 degrees of freedom."""
    mesh = box(HEX20, counts=counts, size=(0.2, 0.04, 0.01), distortion=0.1)
    return supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("x0"))])


def unsupported(mesh: Mesh) -> LinearSystem:
    """A system that no check of supports has seen."""
    mass, stiffness = assemble(mesh, STEEL)
    n = mass.shape[0]
    return LinearSystem(mass=mass, damping=0 * mass, stiffness=stiffness, free=np.arange(n), n_node=mesh.n_node)


def test_a_bar_between_sliding_sides_has_the_pressure_waves_of_the_closed_form(box: BoxMesher) -> None:
    length, n = 0.3, 24
    mesh = box(HEX20, counts=(n, 1, 1), size=(length, 0.02, 0.03))
    every = np.arange(mesh.n_node)
    guides = [Support(nodes=every, directions=(1, 2)), Support(nodes=mesh.nodes("x0"), directions=(0,))]
    result = modes(supported_system(mesh, *assemble(mesh, STEEL), guides), 5).angular_frequency
    speed = sqrt((STEEL.lame + 2 * STEEL.shear) / STEEL.density)
    wave_number = (2 * np.arange(1, 6) - 1) * pi / (2 * length)
    # Quadratic elements: omega is high by (k h)^4 / 1440 to leading order, in one dimension.
    excess = (wave_number * length / n) ** 4 / 1440
    np.testing.assert_allclose(result / (speed * wave_number) - 1, excess, rtol=0.05)


def timoshenko(wave_number: float, height: float, material: Material) -> float:
    """Angular frequency of a simply supported beam of rectangular section, shear coefficient 5/6 for nu = 0."""
    r2 = height**2 / 12
    shear = 5 / 6 * material.shear / material.density
    c2 = material.young / material.density
    k2 = wave_number**2
    # r2/shear w^4 - (1 + r2 k2 (1 + c2/shear)) w^2 + c2 r2 k2^2 = 0, the smaller root.
    a, b, c = r2 / shear, 1 + r2 * k2 * (1 + c2 / shear), c2 * r2 * k2**2
    return sqrt(2 * c / (b + sqrt(b**2 - 4 * a * c)))


def test_a_simply_supported_beam_agrees_with_timoshenko_in_both_planes(box: BoxMesher) -> None:
    length, width, height = 0.3, 0.03, 0.02
    mesh = box(HEX20, counts=(24, 4, 4), size=(length, width, height))
    ends = np.concatenate([mesh.nodes("x0"), mesh.nodes("x1")])
    middle = np.linalg.norm(mesh.points - [0, width / 2, height / 2], axis=1).argmin()
    supports = [Support(nodes=ends, directions=(1, 2)), Support(nodes=np.array([middle]), directions=(0,))]
    result = modes(supported_system(mesh, *assemble(mesh, NO_CONTRACTION), supports), 8).angular_frequency
    for n in (1, 2, 3):
        for depth in (width, height):
            expected = timoshenko(n * pi / length, depth, NO_CONTRACTION)
            # 3e-5 n^2 was measured, and 1e-4 n^2 with half the cells: it is the mesh, not the theory.
            assert np.abs(result / expected - 1).min() < 4e-5 * n**2, (n, depth)


def test_a_slender_cantilever_agrees_with_euler_bernoulli(box: BoxMesher) -> None:
    length, height = 0.4, 0.004
    mesh = box(HEX20, counts=(40, 1, 1), size=(length, 0.003, height))
    system = supported_system(mesh, *assemble(mesh, NO_CONTRACTION), [Support(nodes=mesh.nodes("x0"))])
    result = modes(system, 2)
    speed = sqrt(NO_CONTRACTION.young / NO_CONTRACTION.density)
    expected = 1.8751040687**2 * speed * np.array([0.003, height]) / sqrt(12) / length**2
    # Shear and rotatory inertia take about (height/length)^2; the mesh adds less than 1e-4.
    np.testing.assert_allclose(result.angular_frequency, expected, rtol=3e-4)
    # The first bending mode of a cantilever carries 61.31 % of its mass (Blevins; 4 (0.7341)^2 / 1.8751^2).
    moving = (system.free % 3 == 2).astype(float)
    share = (result.mode_shapes[:, 1] @ system.mass @ moving) ** 2 / (NO_CONTRACTION.density * length * 0.003 * height)
    assert share == pytest.approx(0.6131, abs=2e-3)


def test_a_cube_between_sliding_walls_has_its_threefold_frequency_three_times(
    box: BoxMesher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fe.modal, "MAX_DENSE", 0)  # a single-vector Lanczos run finds copies by round-off alone
    mesh = box(HEX20, counts=(3, 3, 3), size=(1.0, 1.0, 1.0))
    walls = [Support(nodes=mesh.nodes(wall), directions=("xyz".index(wall[0]),)) for wall in mesh.face_sets]
    result = modes(supported_system(mesh, *assemble(mesh, STEEL), walls), 8).angular_frequency
    shear, pressure = sqrt(STEEL.shear / STEEL.density), sqrt((STEEL.lame + 2 * STEEL.shear) / STEEL.density)
    np.testing.assert_allclose(result[:3], result[0], rtol=1e-10)
    expected = np.array([sqrt(2) * shear] * 3 + [sqrt(3) * shear] * 2 + [pressure] * 3) * pi
    np.testing.assert_allclose(result, expected, rtol=5e-3)  # what three quadratic cells a half wave are worth


def test_modes_are_mass_normalised_and_diagonalise_both_matrices(box: BoxMesher) -> None:
    system = cantilever(box)
    result = modes(system, 12)
    phi = result.mode_shapes
    np.testing.assert_allclose(phi.T @ (system.mass @ phi), np.eye(12), atol=1e-11)
    stiffness = phi.T @ (system.stiffness @ phi)
    # Round-off of the stiffness times its spectrum's width, far above these twelve.
    omega2 = result.angular_frequency**2
    np.testing.assert_allclose(stiffness, np.diag(omega2), atol=1e-9 * omega2[-1])
    assert (np.diff(result.angular_frequency) > 0).all()
    np.testing.assert_array_equal(result.frequency, result.angular_frequency / (2 * pi))
    assert (phi.max(axis=0) >= -phi.min(axis=0)).all()


def test_two_runs_agree_to_the_last_bit(box: BoxMesher) -> None:
    system = cantilever(box)
    assert system.n_dof > fe.modal.MAX_DENSE
    first, second = modes(system, 5), modes(system, 5)
    np.testing.assert_array_equal(first.angular_frequency, second.angular_frequency)
    np.testing.assert_array_equal(first.mode_shapes, second.mode_shapes)


def test_dense_and_sparse_solutions_agree(box: BoxMesher, monkeypatch: pytest.MonkeyPatch) -> None:
    system = cantilever(box, counts=(8, 2, 1))
    sparse = {}
    for limit in (0, 10**6):
        monkeypatch.setattr(fe.modal, "MAX_DENSE", limit)
        sparse[limit] = modes(system, 6)
    lanczos, dense = sparse.values()
    # Dense solvers are accurate to round-off times the largest eigenvalue, 1e7 times the lowest here.
    np.testing.assert_allclose(lanczos.angular_frequency, dense.angular_frequency, rtol=1e-8)
    np.testing.assert_allclose(
        np.diag(modal_assurance_criterion(lanczos.mode_shapes, dense.mode_shapes)), 1, atol=1e-10
    )


def test_all_back_ends_give_the_same_frequencies(box: BoxMesher) -> None:
    system = cantilever(box)
    present = [item for item in Backend if is_available(item)]
    first, *others = (modes(system, 8, factorise(system.stiffness, backend=item)).angular_frequency for item in present)
    for other in others:
        # Two factorisations differ by round-off times the stiffness' condition, some 1e6.
        np.testing.assert_allclose(other, first, rtol=1e-9)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3], ids=["millimetre", "metre", "kilometre"])
def test_frequencies_scale_with_one_over_the_size(box: BoxMesher, size: float) -> None:
    mesh = box(HEX20, counts=(6, 2, 2), size=(size, 0.2 * size, 0.1 * size))
    result = modes(supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("x0"))]), 4).frequency
    one = box(HEX20, counts=(6, 2, 2), size=(1.0, 0.2, 0.1))
    reference = modes(supported_system(one, *assemble(one, STEEL), [Support(nodes=one.nodes("x0"))]), 4).frequency
    # A dense solver's round-off is that of the largest eigenvalue, 1e6 times the lowest here.
    np.testing.assert_allclose(result * size, reference, rtol=1e-8)


SINGULAR = "the stiffness is singular to working accuracy: .*fix more nodes"


@pytest.mark.parametrize("counts", [(2, 2, 1), (20, 2, 4)], ids=["dense", "sparse"])
def test_a_free_body_is_refused(box: BoxMesher, counts: tuple[int, int, int]) -> None:
    system = unsupported(box(HEX20, counts=counts, size=(0.3, 0.04, 0.05)))
    with pytest.raises(SupportError, match=SINGULAR):
        modes(system, 3)


def test_a_free_body_is_refused_by_its_modes_when_the_factorisation_saw_nothing(box: BoxMesher) -> None:
    system = unsupported(box(HEX8, counts=(8, 8, 8)))
    factor = factorise(system.stiffness, Definiteness.INDEFINITE, Backend.SUPERLU)
    with pytest.raises(SupportError, match=SINGULAR):
        modes(system, 3, factor)


@pytest.mark.parametrize("n", [1, 6], ids=["dense", "sparse"])
def test_a_hinge_between_two_bodies_is_refused(box: BoxMesher, n: int) -> None:
    # Two cubes that share one edge: the second may turn about it, though no body is loose.
    one = box(HEX8, counts=(n, n, n), size=(1.0, 1.0, 1.0))
    cells = one.cells["hexahedron"]
    moved = one.points + np.array([1, 1, 0])
    shared = np.linalg.norm(moved[:, :2] - [1, 1], axis=1) < 1e-9
    number = np.empty(one.n_node, dtype=np.int64)
    number[shared] = [int(np.linalg.norm(one.points - point, axis=1).argmin()) for point in moved[shared]]
    number[~shared] = one.n_node + np.arange((~shared).sum())
    mesh = Mesh(points=np.vstack([one.points, moved[~shared]]), cells={"hexahedron": np.vstack([cells, number[cells]])})
    system = supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=one.nodes("x0"))])
    with pytest.raises(SupportError, match=SINGULAR):
        modes(system, 1)


def test_springs_too_soft_to_tell_from_none_are_refused(box: BoxMesher) -> None:
    mesh = box(HEX8, counts=(2, 2, 2))
    spring = GroundedSpring(nodes=mesh.nodes("x0"), stiffness=(1e-4, 1e-4, 1e-4))
    with pytest.raises(SupportError, match="stiffen the grounded springs"):
        modes(supported_system(mesh, *assemble(mesh, STEEL), springs=[spring]), 1)


@pytest.mark.parametrize("n_mode", [0, -1, 10_000])
def test_an_impossible_number_of_modes_is_refused(box: BoxMesher, n_mode: int) -> None:
    mesh = box(HEX8, counts=(4, 2, 2), distortion=0.2)
    supports = [Support(nodes=mesh.nodes("x0")), Support(nodes=mesh.nodes("x1"), directions=(1,))]
    system = supported_system(mesh, *assemble(mesh, STEEL), supports)
    with pytest.raises(InputError, match=rf"{n_mode} modes were requested from a system with {system.n_dof} degrees"):
        modes(system, n_mode)


def shapes(seed: int) -> NDArray[np.complex128]:
    real, imaginary = np.random.default_rng(seed).standard_normal((2, 7, 3))
    return np.asarray(real + 1j * imaginary)


def test_mac_sees_direction_alone() -> None:
    phi = shapes(0)
    criterion = modal_assurance_criterion(phi, phi * [1e9, -3j, 1e-9 * np.exp(0.7j)])
    np.testing.assert_allclose(np.diag(criterion), 1, atol=1e-14)
    np.testing.assert_allclose(modal_assurance_criterion(phi, shapes(1)), modal_assurance_criterion(shapes(1), phi).T)


def test_mac_of_known_angles() -> None:
    np.testing.assert_array_equal(modal_assurance_criterion(np.eye(4), np.eye(4)), np.eye(4))
    angle = pi / 3
    pair = modal_assurance_criterion(np.array([[1.0], [0.0]]), np.array([[np.cos(angle)], [np.sin(angle)]]))
    np.testing.assert_allclose(pair, 0.25, atol=1e-15)
    # Quadrature components do not cancel: the modulus is taken, not the real part.
    circular = np.array([[1.0], [1.0j]])
    np.testing.assert_allclose(modal_assurance_criterion(circular, circular.conj()), 0, atol=1e-15)


def test_mac_refuses_shapes_of_different_length() -> None:
    with pytest.raises(InputError, match="on 7 and 5 degrees of freedom cannot be compared"):
        modal_assurance_criterion(shapes(0), shapes(0)[:5])
