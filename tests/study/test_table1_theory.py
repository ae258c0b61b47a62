"""Parasitic strains of the 8-node brick in bending: the closed form against its own derivation and against elements."""

from itertools import product
from math import cos, cosh, sin, sinh

import numpy as np
import pytest

from fe.element import HEX8, HEX20
from fe.material import STEEL, Material
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.mesher.mesh_rule import MeshRule
from fe.mesher.plain_blade import mesh_plain_blade
from geometry.blade import Blade
from geometry.plain_blade import PlainBlade
from study.kind.blade.model import BladeModel, compute_first_frequency
from study.table1 import theory
from study.table1.theory import (
    compute_bending_energy,
    compute_locking_factor,
    find_chord_stations,
    find_span_stations,
    section,
)
from tests.fe.cell_matrices import element_matrices


def bar(n: int, length: float, width: float, thickness: float, n_span: int = 1, n_chord: int = 1) -> Mesh:
    """Bricks of a bar along z, bent through y."""
    size = (width, thickness, length)

    def shape(*uvw: np.ndarray) -> tuple[np.ndarray, ...]:
        return tuple(extent * (part - 0.5) for extent, part in zip(size, uvw, strict=True))

    return mesh_blocks([Block(shape=shape, counts=(n_chord, n, n_span))], HEX8)


def energy_of_exact_bending(mesh: Mesh, material: Material) -> float:
    """Strain energy of 8-node bricks whose nodes move as Saint-Venant's solution does, at unit curvature [J]."""
    x, y, z = mesh.points.T
    nu = material.poisson
    # Axial strain y, contracted across: strains -nu y along x and y, no shear.
    displacement = np.stack([-nu * x * y, -(z**2 + nu * (y**2 - x**2)) / 2, y * z], axis=1)
    cells = mesh.cells["hexahedron"]
    item = np.ones(len(cells))
    stiffness, _ = element_matrices(
        HEX8, mesh.points[cells], material.lame * item, material.shear * item, material.density * item
    )
    u = displacement[cells].reshape(len(cells), -1)
    return float(np.einsum("ci,cij,cj->", u, stiffness, u) / 2)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
@pytest.mark.parametrize(("n", "length", "width"), [(1, 0.01, 0.01), (2, 0.03, 0.004), (5, 0.004, 0.02)])
def test_the_three_parasitic_strains_are_those_of_the_element_itself(
    poisson: float, n: int, length: float, width: float
) -> None:
    thickness = 0.006
    material = Material(young=210e9, poisson=poisson, density=7800.0)
    beam = material.young * width * thickness**3 / 12 * length / 2
    excess = energy_of_exact_bending(bar(n, length, width, thickness), material) / beam - 1
    lateral = poisson**2 * (material.lame + 2 * material.shear) / material.young / n**2
    along = (length / thickness) ** 2 / (2 * (1 + poisson))
    across = poisson**2 * (width / thickness) ** 2 / (2 * (1 + poisson))
    # Exact but for round-off: 2 x 2 x 2 points integrate all terms of a brick.
    assert excess == pytest.approx(along + across + lateral, rel=1e-12)


def test_the_factor_of_a_mesh_is_the_derivation_weighted_by_the_bending_energy_of_its_elements() -> None:
    blade = PlainBlade(root_chord=0.024)
    mesh = mesh_plain_blade(blade, MeshRule(element=HEX8, through_thickness=3, length_ratio=2.4, length_cap=0.004))
    span, chord = find_span_stations(blade, mesh), find_chord_stations(blade, mesh)
    h_x, h_z = np.diff(chord), np.diff(span)
    assert np.ptp(h_z) < 1e-9 > np.ptp(h_x)  # one size each, so that the weights do not matter
    t, nu = blade.thickness, STEEL.poisson
    expected = 1 + ((h_z[0] / t) ** 2 + nu**2 * (h_x[0] / t) ** 2) / (2 * (1 + nu))
    expected += nu**2 * (STEEL.lame + 2 * STEEL.shear) / STEEL.young / 3**2
    assert compute_locking_factor(blade, STEEL, mesh, 3) ** 2 == pytest.approx(expected, rel=1e-9)


def test_long_elements_count_where_the_blade_bends() -> None:
    blade = PlainBlade()
    even = np.linspace(0, blade.length, 21)
    fine_root = blade.length * np.linspace(0, 1, 21) ** 1.5
    fine_tip = blade.length - fine_root[::-1]
    factors = []
    for stations in (fine_root, even, fine_tip):
        block = Block(
            shape=lambda u, v, w, z=stations: (
                blade.chord * (u - 0.5),
                blade.thickness * (v - 0.5),
                np.interp(w, np.linspace(0, 1, 21), z),
            ),
            counts=(2, 3, 20),
        )
        mesh = mesh_blocks([block], HEX8)
        np.testing.assert_allclose(find_span_stations(blade, mesh), stations, atol=1e-12)
        factors.append(compute_locking_factor(blade, STEEL, mesh, 3))
    assert factors == sorted(factors)
    assert factors[2] - factors[0] > 0.01


@pytest.mark.parametrize("length_ratio", [1.0, 2.4])
@pytest.mark.parametrize("n", [2, 4])
def test_the_closed_form_tells_the_frequency_of_linear_bricks_from_that_of_quadratic_ones(
    n: int, length_ratio: float
) -> None:
    def model(element: str, through_thickness: int) -> BladeModel:
        return BladeModel(
            blade=PlainBlade(root_height=0.005),
            material=STEEL,
            element=element,
            through_thickness=through_thickness,
            length_ratio=length_ratio if element == "hex8" else 2.0,
            length_cap=1.0,
            pads=None,  # type: ignore[arg-type]  # a plain blade has none
            drop_every=0,
            n_mode=1,
            damping_ratio=0.0,
        )

    mesh, linear, _ = compute_first_frequency(model("hex8", n))
    _, quadratic, _ = compute_first_frequency(model("hex20", 2))
    factor = compute_locking_factor(PlainBlade(root_height=0.005), STEEL, mesh, n)
    # Left out: that strains across relax, so that c falls from nu^2 (lambda + 2 mu) / E = 0.12 towards
    # nu^2 / (1 - nu^2) = 0.10, which is 0.3 % of f at n = 2, and the clamp's own error in the linear model.
    assert linear / quadratic == pytest.approx(factor, rel=0.007)
    assert factor > 1.015  # what is tested is at least twice its tolerance


@pytest.mark.parametrize("blade", [Blade(), Blade(edge_thickness=0.002, flat_width=0.030), PlainBlade()])
def test_area_and_inertia_are_the_integrals_over_the_section(blade: Blade | PlainBlade) -> None:
    # Trapezoids of a piecewise linear thickness: exact for the area, 1e-9 for the cube at this step.
    x = np.linspace(-blade.chord / 2, blade.chord / 2, 200_001)
    t = np.full_like(x, blade.thickness)
    if isinstance(blade, Blade):
        beyond = np.clip((np.abs(x) - blade.flat_width / 2) / (blade.chord / 2 - blade.flat_width / 2), 0, 1)
        t = blade.thickness + beyond * (blade.edge_thickness - blade.thickness)
    area, inertia = section(blade)
    assert area == pytest.approx(np.trapezoid(t, x), rel=1e-8)
    assert inertia == pytest.approx(np.trapezoid(t**3 / 12, x), rel=1e-8)


def mode(s: float) -> float:
    """First mode of a clamped-free beam, 2 at its tip."""
    b, sigma = theory.FIRST_MODE * s, theory.SIGMA
    return cosh(b) - cos(b) - sigma * (sinh(b) - sin(b))


def test_the_mode_behind_the_weights_meets_its_four_boundary_conditions() -> None:
    b, sigma = theory.FIRST_MODE, theory.SIGMA
    assert mode(0) == 0
    assert mode(1e-6) == pytest.approx(0, abs=1e-11)  # no slope: it starts as s^2
    # No moment and no shear at the tip, to the nine digits of beta L.
    assert cosh(b) + cos(b) - sigma * (sinh(b) + sin(b)) == pytest.approx(0, abs=1e-8)
    assert sinh(b) - sin(b) - sigma * (cosh(b) + cos(b)) == pytest.approx(0, abs=1e-7)


def test_shares_of_bending_energy_are_those_of_the_closed_form() -> None:
    def integral(s: float) -> float:
        """Of (phi'' / beta^2)^2 from 0 to s, by partial integration."""
        b, sigma = theory.FIRST_MODE, theory.SIGMA
        f = [mode(s), sinh(b * s) + sin(b * s) - sigma * (cosh(b * s) - cos(b * s))]
        f += [cosh(b * s) + cos(b * s) - sigma * (sinh(b * s) + sin(b * s))]
        f += [sinh(b * s) - sin(b * s) - sigma * (cosh(b * s) + cos(b * s))]
        # With f'''' = f (in b s): 4 int f''^2 = 3 f'' f' + s f''^2 - 2 s f' f''' - f f''' + s f^2.
        x = b * s
        return (3 * f[2] * f[1] + x * f[2] ** 2 - 2 * x * f[1] * f[3] - f[0] * f[3] + x * f[0] ** 2) / (4 * b)

    stations = np.array([0.0, 0.1, 0.15, 0.4, 0.7, 1.0])
    share = compute_bending_energy(stations)
    values = np.array([integral(s) for s in stations])
    expected = np.diff(values) / (values[-1] - values[0])
    # Nine digits of beta L.
    np.testing.assert_allclose(share, expected, rtol=1e-7, atol=1e-9)
    assert share.sum() == pytest.approx(1, abs=1e-14)


def test_bending_energy_falls_from_root_to_tip() -> None:
    share = compute_bending_energy(np.linspace(0, 1, 31))
    assert (np.diff(share) < 0).all()
    assert share.min() > 0


def test_stations_of_the_rig_are_those_of_its_elements_outside_the_pads() -> None:
    from fe.mesher.blade import mesh_blade

    blade = Blade()
    rule = MeshRule(element=HEX20, through_thickness=1, length_ratio=2.3, length_cap=0.008)
    mesh = mesh_blade(blade, rule)
    span, chord = find_span_stations(blade, mesh), find_chord_stations(blade, mesh)
    assert (span[0], span[-1]) == (pytest.approx(0, abs=1e-12), pytest.approx(blade.length))
    assert (chord[0], chord[-1]) == (pytest.approx(-blade.chord / 2), pytest.approx(blade.chord / 2))
    for stations in (span, chord):
        assert (np.diff(stations) > 1e-4).all()  # none twice
        assert (np.diff(stations) < rule.size(blade.thickness) + 1e-9).all()


@pytest.mark.parametrize(("axis", "sign"), list(product(range(3), (1, -1))))
def test_the_derivation_does_not_depend_on_where_the_axes_are(axis: int, sign: int) -> None:
    # Bending of two rows beside each other: an element off the middle has the same parasitic energy.
    one = energy_of_exact_bending(bar(2, 0.01, 0.006, 0.006), STEEL)
    mesh = bar(2, 0.02, 0.012, 0.006, n_span=2, n_chord=2)
    points = mesh.points.copy()
    points[:, axis] += 0.0 if axis == 1 else sign * 0.05
    moved = Mesh(points=points, cells=mesh.cells)
    assert energy_of_exact_bending(moved, STEEL) == pytest.approx(4 * one, rel=1e-9)
