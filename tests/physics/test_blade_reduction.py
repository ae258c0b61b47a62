"""The slotted blade, from its mesh to the resonance peak of its reduced model."""

from functools import cache

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.damping import rayleigh_damping
from fe.element import HEX8, HEX20
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.blade import mesh_blade
from fe.mesher.mesh_rule import MeshRule
from fe.modal import ModeSet, modes
from fe.sparse.solver import factorise
from fe.stress import compute_nodal_stress
from fe.system import LinearSystem
from geometry.blade import Blade
from hbsolve.continuation.peak import resonance_peak, undamped_from_peak
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.forced_response import HarmonicForce, forced_response
from reduction.craig_bampton import craig_bampton
from reduction.rom import ReducedModel
from reduction.rom_error import rom_error
from tests.slow import slow

ZETA = 0.002
N = 10
BOUNDARY = ("excitation", "response", "contact_positive", "contact_negative")


@cache
def blade(element: str) -> tuple[Mesh, LinearSystem]:
    rule = {
        "hex8": MeshRule(element=HEX8, through_thickness=2, length_ratio=4.0, length_cap=0.012),
        "hex20": MeshRule(element=HEX20, through_thickness=1, length_ratio=4.0, length_cap=0.012),
    }[element]
    mesh = mesh_blade(Blade(), rule)
    mass, stiffness = assemble(mesh, STEEL)
    damping = rayleigh_damping(ZETA, 122.0)
    return mesh, supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes("clamp"))], damping=damping)


@cache
def reduced(element: str, n_mode: int = 150) -> ReducedModel:
    mesh, system = blade(element)
    return craig_bampton(system, {name: system.rows(mesh.node_sets[name]) for name in BOUNDARY}, n_mode)


def extended_frequency(system: LinearSystem, shapes: np.ndarray) -> np.ndarray:
    """Square roots of Rayleigh quotients in extended precision [Hz].

    A quotient is second order in the error of the shape, so it is free of the round-off of the solver that made the
    shape; in double precision that alone is 3e-9 for the first mode of a blade.
    """

    def energy(matrix: sp.csr_array) -> np.ndarray:
        rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
        values = matrix.data.astype(np.longdouble)
        x = shapes.astype(np.longdouble)
        return np.array([np.sum(x[rows, m] * values * x[matrix.indices, m]) for m in range(x.shape[1])])

    return np.sqrt(energy(system.stiffness) / energy(system.mass)) / (2 * np.pi)


@cache
def full_modes(element: str) -> ModeSet:
    """Some more modes of the full model than are compared."""
    return modes(blade(element)[1], N + 5)


@cache
def full_frequency(element: str) -> np.ndarray:
    """Of the full model, to 1e-12: shapes improved by one step of subspace iteration, quotients in long numbers."""
    _, system = blade(element)
    shapes = factorise(system.stiffness).solve(system.mass @ full_modes(element).mode_shapes)
    stiffness, mass = (shapes.T @ (matrix @ shapes) for matrix in (system.stiffness, system.mass))
    _, rotation = scipy.linalg.eigh((mass + mass.T) / 2, (stiffness + stiffness.T) / 2)
    return extended_frequency(system, shapes @ rotation[:, ::-1][:, :N])


def true_error(element: str, rom: ReducedModel) -> np.ndarray:
    _, system = blade(element)
    recovered = rom.recovery @ rom.modes(N).mode_shapes
    return np.asarray(extended_frequency(system, recovered) / full_frequency(element) - 1, dtype=float)


@pytest.mark.parametrize("element", ["hex8", "hex20"])
def test_with_150_modes_five_frequencies_are_right_to_1e_6_and_ten_to_2e_5(element: str) -> None:
    error = reduced(element).modes(N).frequency / full_modes(element).frequency[:N] - 1
    assert np.all(np.abs(error[:5]) < 1e-6)
    assert np.all(np.abs(error) < 2e-5)


@pytest.mark.parametrize(
    ("element", "n_mode"), [("hex8", 5), ("hex8", 30), ("hex8", 150), pytest.param("hex20", 150, marks=slow)]
)
def test_the_estimated_error_is_the_true_one_within_a_factor_of_three(element: str, n_mode: int) -> None:
    rom = reduced(element, n_mode)
    true, estimate = true_error(element, rom), rom_error(blade(element)[1], rom, N)
    counts = true > 1e-9
    assert counts.sum() >= 5
    np.testing.assert_array_less(estimate[counts], 3 * true[counts])
    np.testing.assert_array_less(true[counts] / 3, estimate[counts])


def test_the_zeta_corrected_peak_is_the_first_natural_frequency_to_1e_5() -> None:
    rom = reduced("hex20")
    structure = DynamicStiffness.of(rom)
    row, column = rom.rows("response", 1), rom.rows("excitation", 1)
    natural = float(rom.modes(1).angular_frequency[0])
    peak = resonance_peak(
        lambda omega: np.abs(structure.receptance(omega, row, column)[:, 0, 0]), 0.8 * natural, 1.2 * natural
    )
    damping_ratio = float(rom.modes(1).damping_ratio[0])
    np.testing.assert_allclose(undamped_from_peak(peak, damping_ratio), natural, rtol=1e-5)


def test_rayleigh_damping_stays_diagonal_in_the_reduced_modes() -> None:
    assert not DynamicStiffness.of(reduced("hex20")).damping_couples_modes


def test_the_reduced_response_is_the_full_response_with_its_stress() -> None:
    mesh, system = blade("hex8")
    rom = reduced("hex8")
    omega = 2 * np.pi * 110.0
    coefficients = np.zeros((2, rom.n_dof), dtype=complex)
    coefficients[1, rom.rows("excitation", 1)] = 1.0
    branch = forced_response(rom, HarmonicForce(coefficients=coefficients), np.array([omega]))
    assert branch.residual_norm[0] < 1e-6  # over nodes whose stiffness is 1e6 times that of the blade
    field = rom.displacement(branch.coefficients[0, 1])

    force = np.zeros(system.n_dof)
    force[system.rows(mesh.node_sets["excitation"], (1,))] = 1.0
    dynamic = system.stiffness - omega**2 * system.mass + 1j * omega * system.damping
    full = system.on_mesh(sp.linalg.spsolve(dynamic.tocsc(), force.astype(complex))[:, None])[..., 0]
    # Truncation: 1e-6 in displacement, more in stress, which sees the short waves.
    assert np.abs(field - full).max() < 1e-5 * np.abs(full).max()
    stress, full_stress = (compute_nodal_stress(mesh, STEEL, part.real) for part in (field, full))
    assert np.abs(stress - full_stress).max() < 1e-3 * np.abs(full_stress).max()
