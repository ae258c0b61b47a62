"""A body on a support that moves as one rigid piece on springs, and a body in another material."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import brentq

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.damping import rayleigh_damping
from fe.element import HEX20
from fe.material import Material
from fe.mesh import Mesh
from fe.mesher.block import Block, Lattice, mesh_blocks
from reduction.craig_bampton import craig_bampton
from reduction.elastic_support import ElasticBody, ElasticSupport, find_elastic_support, put_on_springs
from reduction.errors import RomError
from reduction.other_material import in_other_material
from reduction.rom import ReducedModel, with_rayleigh_damping

#: Without Poisson's ratio a fixed end is no stiffer than that of a beam.
STEEL = Material(young=210e9, poisson=0.0, density=7800)
#: Length, width and thickness of the bar [m]: so slender that shear hardly matters.
LENGTH, WIDTH, THICKNESS = 0.4, 0.012, 0.008
#: Bending about x, the weaker axis.
RIGIDITY = STEEL.young * WIDTH * THICKNESS**3 / 12
LINE_MASS = STEEL.density * WIDTH * THICKNESS
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Bar:
    mesh: Mesh
    mass: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    rom: ReducedModel
    support: ElasticSupport


def make_bar(n_mode: int = 12, density: float = STEEL.density, young: float = STEEL.young) -> Bar:
    """Along z, clamped at z = 0; the corners of three sections are kept: near the clamp, in the middle, at the tip."""

    def shape(u: Lattice, v: Lattice, w: Lattice) -> tuple[Lattice, Lattice, Lattice]:
        return WIDTH * u, THICKNESS * v, LENGTH * w

    mesh = mesh_blocks([Block(shape=shape, counts=(1, 1, 16), faces={"w0": "clamp", "w1": "tip"})], HEX20)
    mass, stiffness = assemble(mesh, replace(STEEL, density=density, young=young))
    system = supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes("clamp"))])
    corners = mesh.corner_nodes()
    sections = {
        name: corners[np.isclose(mesh.points[corners, 2], z)]
        for name, z in {"low": 0.05, "middle": 0.2, "tip": LENGTH}.items()
    }
    rom = craig_bampton(system, {name: system.rows(nodes) for name, nodes in sections.items()}, n_mode)
    support = find_elastic_support(mesh, "clamp", mass, rom, mesh.points)
    return Bar(mesh, mass.toarray(), stiffness.toarray(), rom, support)


@pytest.fixture(scope="module")
def bar() -> Bar:
    return make_bar()


def beam_root(spring: float, turning: float) -> float:
    """First root beta L of a beam whose clamp has a spring [N/m] and a spring in rotation [N m], its other end free.

    With u = a1 cos + a2 sin + a3 cosh + a4 sinh of beta z: EI u''' = k u and EI u'' = k_r u' taken with the signs of
    what pushes back at z = 0, and no moment and no shear at L.
    """

    def determinant(root: float) -> float:
        beta = root / LENGTH
        c, s, ch, sh = np.cos(root), np.sin(root), np.cosh(root), np.sinh(root)
        shear, moment = spring / (RIGIDITY * beta**3), turning / (RIGIDITY * beta)
        return float(
            np.linalg.det(
                [
                    [shear, -1.0, shear, 1.0],
                    [-1.0, -moment, 1.0, -moment],
                    [-c, -s, ch, sh],
                    [s, -c, sh, ch],
                ]
            )
        )

    # From a weak clamp to a fixed one, at 1.8751.
    return float(brentq(determinant, 0.05, 1.8752))


def test_springs_are_spread_evenly_over_the_support(bar: Bar) -> None:
    along = np.diag(bar.support.springs)
    assert along[:3] == pytest.approx([1, 1, 1])
    # Second moments of a rectangle about its middle, over its area.
    assert along[3:] == pytest.approx([THICKNESS**2 / 12, WIDTH**2 / 12, (THICKNESS**2 + WIDTH**2) / 12])
    assert bar.support.springs - np.diag(along) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("stiffness", [1e9, 1e8, 1e7])
def test_a_beam_on_root_springs_has_the_frequency_of_the_closed_form(bar: Bar, stiffness: float) -> None:
    fixed, relaxed = (
        rom.modes(1).frequency[0] for rom in (bar.rom, put_on_springs(bar.rom, bar.support, 1 / stiffness))
    )
    turning = stiffness * THICKNESS**2 / 12
    exact = (beam_root(stiffness, turning) / 1.87510407) ** 2
    # Shear and rotatory inertia are of (thickness / length)^2 = 4e-4.
    assert fixed == pytest.approx(1.87510407**2 * np.sqrt(RIGIDITY / LINE_MASS) / (2 * np.pi * LENGTH**2), rel=1e-3)
    assert relaxed / fixed == pytest.approx(exact, rel=1e-3)
    assert exact < 0.985


def test_statically_it_is_the_full_bar_on_a_rigid_piece_with_springs(bar: Bar) -> None:
    stiffness = 3e7
    clamp = bar.mesh.nodes("clamp")
    centre = np.array([WIDTH / 2, THICKNESS / 2, 0.0])
    rigid = np.zeros((3 * bar.mesh.n_node, 6))
    for node in clamp:
        x, y, z = bar.mesh.points[node] - centre
        rigid[3 * node : 3 * node + 3] = [[1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x], [0, 0, 1, y, -x, 0]]
    free = bar.rom.free
    basis = np.hstack([np.eye(3 * bar.mesh.n_node)[:, free], rigid])
    whole = basis.T @ bar.stiffness @ basis
    whole[-6:, -6:] += stiffness * bar.support.springs
    inertia = basis.T @ bar.mass @ basis
    relaxed = put_on_springs(bar.rom, bar.support, 1 / stiffness)
    tip = np.searchsorted(free, 3 * bar.rom.boundary_node + bar.rom.boundary_direction)
    flexibility = np.linalg.inv(whole)[np.ix_(tip, tip)]
    n = len(tip)
    assert np.linalg.inv(relaxed.stiffness)[:n, :n] == pytest.approx(
        flexibility, rel=1e-6, abs=1e-6 * flexibility.max()
    )
    # The springs push back with what pushes the tip.
    body = ElasticBody(mass=bar.rom.mass, stiffness=bar.rom.stiffness, support=bar.support, compliance=1 / stiffness)
    last = np.linalg.solve(relaxed.stiffness, np.eye(relaxed.n_dof)[n - 1])
    pushed = np.zeros(3)
    pushed[bar.rom.boundary_direction[n - 1]] = 1.0
    assert body.reaction.stiffness @ last == pytest.approx(-pushed, abs=1e-6)
    # Frequencies lie above those in full, by what 12 modes and a clamp without inertia of its own leave out.
    full = np.sqrt(scipy.linalg.eigh(whole, inertia, eigvals_only=True, subset_by_index=[0, 2])) / (2 * np.pi)
    excess = relaxed.modes(3).frequency / full - 1
    assert np.all(excess > -1e-7)
    assert np.all(excess < 1e-4)
    # The recovery is that of the full bar, here under a force at the tip.
    force = np.zeros(len(whole))
    force[tip[1]] = 1.0
    reduced = np.linalg.solve(relaxed.stiffness, np.eye(relaxed.n_dof)[1])
    assert relaxed.rows("low", 1)[0] == 1
    assert relaxed.recovery @ reduced == pytest.approx(np.linalg.solve(whole, force)[:-6], rel=1e-5, abs=1e-11)


def test_without_compliance_nothing_changes_and_without_springs_the_bar_is_free(bar: Bar) -> None:
    mass, stiffness = bar.support.matrices(bar.rom.mass, bar.rom.stiffness, 0.0)
    np.testing.assert_array_equal(mass, bar.rom.mass)
    np.testing.assert_array_equal(stiffness, bar.rom.stiffness)
    # 1 N/um of the springs is nothing beside 1e-9 of it.
    mass, stiffness = bar.support.matrices(bar.rom.mass, bar.rom.stiffness, 1e9)
    motion = bar.support.motion
    energy = motion.T @ mass @ motion
    assert np.diag(energy)[:3] == pytest.approx([LINE_MASS * LENGTH] * 3, rel=1e-6)
    assert energy[3, 3] == pytest.approx(LINE_MASS * LENGTH * (LENGTH**2 / 3 + THICKNESS**2 / 12), rel=1e-6)
    assert np.abs(stiffness @ motion).max() < ROUND_OFF * np.abs(bar.rom.stiffness).max()


def test_a_body_among_others_keeps_its_matrices(bar: Bar) -> None:
    body = ElasticBody(mass=bar.rom.mass, stiffness=bar.rom.stiffness, support=bar.support, compliance=1e-8)
    n, columns = bar.rom.n_dof + 5, slice(2, 2 + bar.rom.n_dof)
    for wide, own in zip(body.embed(n, columns).matrices, body.matrices, strict=True):
        np.testing.assert_allclose(wide[columns, columns], own, rtol=ROUND_OFF, atol=ROUND_OFF * np.abs(own).max())
        assert np.abs(wide).sum() == pytest.approx(np.abs(own).sum(), rel=ROUND_OFF)


def test_another_material_is_that_which_would_be_reduced(bar: Bar) -> None:
    light = make_bar(density=0.9 * STEEL.density, young=1.2 * STEEL.young)
    changed = in_other_material(bar.rom, 0.9, 1.2)
    assert changed.fixed_interface_frequency == pytest.approx(light.rom.fixed_interface_frequency, rel=1e-8)
    assert changed.modes(6).frequency == pytest.approx(light.rom.modes(6).frequency, rel=1e-8)
    modal = slice(bar.rom.n_boundary, None)
    assert changed.mass[modal, modal] == pytest.approx(np.eye(12), abs=1e-9)
    on_springs = put_on_springs(changed, bar.support.scaled(0.9, bar.rom.n_boundary), 1e-7)
    expected = put_on_springs(light.rom, light.support, 1e-7)
    assert on_springs.modes(6).frequency == pytest.approx(expected.modes(6).frequency, rel=1e-8)


def test_what_cannot_be_put_on_springs_is_refused(bar: Bar) -> None:
    with pytest.raises(RomError, match="compliance"):
        put_on_springs(bar.rom, bar.support, -1e-9)
    with pytest.raises(RomError, match="damping"):
        put_on_springs(with_rayleigh_damping(bar.rom, rayleigh_damping(0.01, 40.0)), bar.support, 1e-9)
    with pytest.raises(RomError, match="no faces"):
        find_elastic_support(bar.mesh, "foot", np.eye(3 * bar.mesh.n_node), bar.rom, bar.mesh.points)
