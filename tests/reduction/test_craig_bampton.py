"""What a Craig-Bampton model must satisfy."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import fe.sparse.block_lanczos
import reduction.craig_bampton
from fe.assembly import assemble, assemble_compact
from fe.boundary import GroundedSpring, Support, make_rigid_motions, supported_system
from fe.damping import RayleighDamping, add_damping, rayleigh_damping
from fe.material import STEEL, Material
from fe.mesh import Mesh
from fe.sparse.factor import Symmetric
from fe.system import LinearSystem
from reduction.craig_bampton import craig_bampton
from reduction.errors import RomError
from reduction.rom import with_rayleigh_damping

# Condition numbers here are below 1e6: ten digits of a double survive.
ROUND_OFF = 1e-9


def random_system(seed: int, n_node: int = 12) -> LinearSystem:
    rng = np.random.default_rng(seed)
    n = 3 * n_node
    spring = rng.standard_normal((n, n)) * (rng.random((n, n)) < 0.3)
    inertia = rng.standard_normal((n, n)) * 0.3
    return system_of(inertia @ inertia.T + np.eye(n), spring @ spring.T + np.diag(rng.uniform(1, 100, n)))


def system_of(mass: np.ndarray, stiffness: np.ndarray) -> LinearSystem:
    return LinearSystem(
        mass=sp.csr_array(mass),
        damping=sp.csr_array(0.3 * mass + 0.002 * stiffness),
        stiffness=sp.csr_array(stiffness),
        free=np.arange(len(mass)),
        n_node=len(mass) // 3,
    )


def box(nx: int = 4, ny: int = 2, nz: int = 2) -> Mesh:
    x, y, z = np.meshgrid(*(np.arange(k + 1) for k in (nx, ny, nz)), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    corner = number[:-1, :-1, :-1].ravel()
    dx, dy, dz = (ny + 1) * (nz + 1), nz + 1, 1
    bottom = [0, dx, dx + dy, dy]
    cells = corner[:, None] + np.array(bottom + [k + dz for k in bottom])
    points = np.stack([x.ravel() * 0.02, y.ravel() * 0.01, z.ravel() * 0.012], axis=1)
    return Mesh(points=points, cells={"hexahedron": cells})


def clamped_box() -> tuple[Mesh, LinearSystem]:
    mesh = box()
    mass, stiffness = assemble(mesh, STEEL)
    clamp = np.flatnonzero(mesh.points[:, 0] == 0)
    damping = rayleigh_damping(0.002, 1000.0)
    return mesh, supported_system(mesh, mass, stiffness, [Support(nodes=clamp)], damping=damping)


def full_lambda(system: LinearSystem) -> np.ndarray:
    return scipy.linalg.eigh(system.stiffness.toarray(), system.mass.toarray(), eigvals_only=True)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_all_modes_kept_give_the_full_model(seed: int) -> None:
    system = random_system(seed)
    rom = craig_bampton(system, {"tip": np.array([3, 17, 8])}, n_mode=1000)  # more than there are: all
    assert rom.n_dof == system.n_dof
    np.testing.assert_allclose(rom.modes().angular_frequency ** 2, full_lambda(system), rtol=ROUND_OFF)


@given(seed=st.integers(0, 2**32 - 1), n_mode=st.integers(0, 30), n_boundary=st.integers(1, 12))
@settings(max_examples=25, deadline=None)
def test_reduced_frequencies_are_never_below_the_full_ones(seed: int, n_mode: int, n_boundary: int) -> None:
    system = random_system(seed)
    rows = np.random.default_rng(seed).permutation(system.n_dof)[:n_boundary]
    lambda_ = craig_bampton(system, {"boundary": rows}, n_mode).modes().angular_frequency ** 2
    assert np.all(lambda_ >= full_lambda(system)[: len(lambda_)] * (1 - ROUND_OFF))


def test_the_model_is_statically_exact_at_its_boundary() -> None:
    _, system = clamped_box()
    rows = np.array([5, 40, 99])
    rom = craig_bampton(system, {"contact": rows}, n_mode=3)
    compliance = np.linalg.inv(system.stiffness.toarray())[np.ix_(rows, rows)]
    reduced = np.linalg.inv(rom.stiffness)[:3, :3]
    np.testing.assert_allclose(reduced, compliance, rtol=ROUND_OFF, atol=ROUND_OFF * compliance.max())


def test_a_static_boundary_force_recovers_the_full_displacement_field() -> None:
    mesh, system = clamped_box()
    tip = int(mesh.n_node - 1)
    rom = craig_bampton(system, {"tip": system.rows(np.array([tip]))}, n_mode=2)
    force = np.zeros(system.n_dof)
    force[system.rows(np.array([tip]), (1,))] = 10.0
    full = system.on_mesh(np.linalg.solve(system.stiffness.toarray(), force)[:, None])[..., 0]
    reduced_force = np.zeros(rom.n_dof)
    reduced_force[rom.rows("tip", 1)] = 10.0
    field = rom.displacement(np.linalg.solve(rom.stiffness, reduced_force))
    np.testing.assert_allclose(field, full, atol=ROUND_OFF * np.abs(full).max())


def test_constraint_modes_reproduce_rigid_body_motion_of_a_free_body() -> None:
    mesh = box()
    mass, stiffness = assemble(mesh, STEEL)
    system = LinearSystem(
        mass=mass,
        damping=sp.csr_array(mass.shape),
        stiffness=stiffness,
        free=np.arange(3 * mesh.n_node),
        n_node=mesh.n_node,
    )
    nodes = np.array([0, 8, 38])  # not in line: they hold the interior
    rom = craig_bampton(system, {"held": system.rows(nodes)}, n_mode=4)
    motions = make_rigid_motions(mesh.points)
    reduced = np.zeros((rom.n_dof, 6))
    reduced[: rom.n_boundary] = motions[nodes].reshape(-1, 6)
    np.testing.assert_allclose(rom.displacement(reduced), motions, atol=ROUND_OFF)
    # A rigid motion strains nothing: its force is round-off of the largest stiffness.
    assert np.abs(rom.stiffness @ reduced).max() < 1e-10 * np.abs(rom.stiffness[:9, :9]).max()
    np.testing.assert_allclose(reduced.T @ rom.mass @ reduced, rigid_mass(mesh, mass), rtol=ROUND_OFF, atol=1e-12)


def long_bar(springs: bool, assembled: Callable[[Mesh, Material], tuple[Symmetric, Symmetric]]) -> LinearSystem:
    mesh = box(20, 9, 6)
    # Without symmetry, so that no two components of a mode are alike and its sign is no matter of round-off.
    x, y, z = mesh.points.T
    mesh = replace(mesh, points=np.stack([x, y * (1 + x), z * (1 + 2 * x + 10 * y)], axis=1))
    mass, stiffness = assembled(mesh, STEEL)
    clamp = np.flatnonzero(mesh.points[:, 0] == 0)
    if springs:
        return supported_system(mesh, mass, stiffness, springs=[GroundedSpring(nodes=clamp, stiffness=(1e9, 2e9, 3e9))])
    return supported_system(mesh, mass, stiffness, [Support(nodes=clamp)])


@pytest.mark.parametrize("springs", [False, True], ids=["clamped", "on springs"])
@pytest.mark.parametrize("boundary", [[30, 31, 32, 90, 91, 92], [31, 90, 200]], ids=["whole nodes", "directions"])
def test_matrices_of_which_half_is_stored_give_the_same_model(springs: bool, boundary: list[int]) -> None:
    compact, whole = (
        craig_bampton(long_bar(springs, way), {"kept": np.array(boundary)}, n_mode=20)
        for way in (assemble_compact, assemble)
    )
    for name in ("stiffness", "mass", "recovery"):
        result, expected = getattr(compact, name), getattr(whole, name)
        np.testing.assert_allclose(result, expected, rtol=0, atol=ROUND_OFF * np.abs(expected).max())


def test_narrow_blocks_and_a_short_basis_change_nothing_but_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    system = long_bar(False, assemble_compact)
    boundary = {"kept": np.arange(40)}
    wide = craig_bampton(system, boundary, n_mode=50)
    monkeypatch.setattr(reduction.craig_bampton, "AT_ONCE", 7)
    monkeypatch.setattr(reduction.craig_bampton, "MEMORY", 1.0)
    monkeypatch.setattr(fe.sparse.block_lanczos, "MEMORY", 1.0)
    narrow = craig_bampton(system, boundary, n_mode=50)
    np.testing.assert_allclose(narrow.recovery, wide.recovery, rtol=0, atol=ROUND_OFF * np.abs(wide.recovery).max())
    np.testing.assert_allclose(narrow.fixed_interface_frequency, wide.fixed_interface_frequency, rtol=ROUND_OFF)


def rigid_mass(mesh: Mesh, mass: sp.csr_array) -> np.ndarray:
    motions = make_rigid_motions(mesh.points).reshape(-1, 6)
    return motions.T @ (mass @ motions)


def test_damping_of_the_reduced_model_is_the_full_ones_reduced() -> None:
    _, system = clamped_box()
    damping = RayleighDamping(mass_factor=30.0, stiffness_factor=2e-7)
    boundary = {"a": np.array([7, 3]), "b": np.array([50])}
    of_full = craig_bampton(add_damping(system, damping), boundary, n_mode=8).damping
    of_reduced = with_rayleigh_damping(craig_bampton(system, boundary, n_mode=8), damping).damping
    np.testing.assert_allclose(of_reduced, of_full, rtol=0, atol=ROUND_OFF * np.abs(of_full).max())


def test_projected_matrices_are_those_of_the_definition() -> None:
    _, system = clamped_box()
    rom = craig_bampton(system, {"a": np.array([7, 3]), "b": np.array([50])}, n_mode=8)
    T = rom.recovery
    for reduced, full in ((rom.mass, system.mass), (rom.damping, system.damping), (rom.stiffness, system.stiffness)):
        product = T.T @ (full @ T)
        scale = np.sqrt(np.outer(np.diag(product), np.diag(product)))
        np.testing.assert_allclose(reduced / scale, product / scale, atol=ROUND_OFF)


def test_sets_that_overlap_share_their_degrees_of_freedom() -> None:
    system = random_system(1)
    rom = craig_bampton(system, {"slot": np.array([20, 4, 6]), "sensor": np.array([6, 9])}, n_mode=2)
    assert rom.n_boundary == 4
    np.testing.assert_array_equal(rom.boundary_node * 3 + rom.boundary_direction, [20, 4, 6, 9])
    np.testing.assert_array_equal(rom.rows("slot"), [0, 1, 2])
    np.testing.assert_array_equal(rom.rows("sensor"), [2, 3])


def test_without_modes_it_is_guyan_condensation_and_without_interior_the_system_itself() -> None:
    system = random_system(2, n_node=4)
    assert craig_bampton(system, {"a": np.array([1, 5])}, n_mode=0).n_dof == 2
    rom = craig_bampton(system, {"all": np.arange(12)})
    np.testing.assert_array_equal(rom.stiffness, system.stiffness.toarray())
    assert rom.fixed_interface_frequency.size == 0


def test_without_boundary_it_is_modal_truncation() -> None:
    system = random_system(3)
    rom = craig_bampton(system, {}, n_mode=5)
    np.testing.assert_allclose(rom.modes().angular_frequency ** 2, full_lambda(system)[:5], rtol=ROUND_OFF)


@pytest.mark.parametrize(
    ("boundary", "n_mode", "message"),
    [
        ({"tip": np.array([], dtype=int)}, 5, '"tip" is empty'),
        ({"ok": np.array([1]), "clamp": np.array([3, -1, -1])}, 5, r'"clamp" names 2 of 3 .* fix .*entry 1'),
        ({"tip": np.array([36])}, 5, '"tip" names row 36: the system has rows 0 to 35'),
        ({"tip": np.array([-7, 2])}, 5, '"tip" names row -7'),
        ({"tip": np.array([2])}, -1, "n_mode = -1"),
        ({}, 0, "without boundary and without modes"),
    ],
)
def test_a_wrong_boundary_is_refused_in_one_sentence(boundary: dict, n_mode: int, message: str) -> None:
    with pytest.raises(RomError, match=message):
        craig_bampton(random_system(0), boundary, n_mode)


def test_an_interior_that_the_boundary_does_not_hold_is_refused() -> None:
    mesh = box()
    mass, stiffness = assemble(mesh, STEEL)
    free = LinearSystem(
        mass=mass,
        damping=sp.csr_array(mass.shape),
        stiffness=stiffness,
        free=np.arange(3 * mesh.n_node),
        n_node=mesh.n_node,
    )
    with pytest.raises(RomError, match=r"132 interior degrees of freedom can still move as a rigid body"):
        craig_bampton(free, {"one node": free.rows(np.array([0]))}, n_mode=5)
