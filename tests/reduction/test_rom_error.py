"""The estimated truncation error against the true one."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp

from fe.dense_modes import compute_dense_modes
from fe.system import LinearSystem
from reduction.craig_bampton import craig_bampton
from reduction.errors import RomError
from reduction.rom_error import rom_error
from tests.slow import slow

#: What the estimate promises, and from which true error on.
FACTOR, FROM = 3.0, 1e-9


def lattice(nx: int, ny: int, heavy: float = 1.0, stiff: float = 1.0) -> LinearSystem:
    """A membrane of springs, held along its edges, consistent-like mass, some heavy points and a stiff stripe."""
    rng = np.random.default_rng(0)

    def line(n: int) -> tuple[sp.csr_array, sp.csr_array]:
        spring = sp.diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
        return sp.csr_array(spring), sp.csr_array((6 * sp.eye_array(n) - spring) / 6)

    (kx, mx), (ky, my) = line(nx), line(ny)
    stiffness = sp.csr_array(sp.kron(kx, my) + sp.kron(mx, ky))
    mass = sp.csr_array(sp.kron(mx, my))
    n = nx * ny
    point = np.zeros(n)
    point[rng.permutation(n)[: n // 20]] = heavy
    stripe = np.ones(n)
    stripe[: n // 4] = np.sqrt(stiff)
    scale = sp.diags_array(stripe)
    return LinearSystem(
        mass=sp.csr_array(mass + sp.diags_array(point)),
        damping=sp.csr_array((n, n)),
        stiffness=sp.csr_array(scale @ stiffness @ scale),
        free=np.arange(n),
        n_node=n // 3,
    )


@cache
def full_frequency(system: LinearSystem) -> np.ndarray:
    return np.sqrt(compute_dense_modes(system.mass.toarray(), system.stiffness.toarray()).lambda_) / (2 * np.pi)


def true_error(system: LinearSystem, frequency: np.ndarray) -> np.ndarray:
    return frequency / full_frequency(system)[: len(frequency)] - 1


# More than 660 degrees of freedom, so that interior modes come from Lanczos, which gives the lowest all their digits.
STRUCTURES = {
    "uniform": lattice(31, 22),
    "narrow": lattice(222, 3),
    "heavy points": lattice(31, 22, heavy=30.0),
    "heavy and stiff": lattice(31, 22, heavy=100.0, stiff=1e4),
}
BOUNDARIES = {"one": 1, "few": 5, "many": 60}


@pytest.mark.parametrize("n_mode", [5, 30, pytest.param(150, marks=slow)])
@pytest.mark.parametrize("n_boundary", BOUNDARIES.values(), ids=BOUNDARIES)
@pytest.mark.parametrize("structure", STRUCTURES)
def test_the_estimate_is_within_a_factor_of_three(structure: str, n_boundary: int, n_mode: int) -> None:
    system = STRUCTURES[structure]
    rows = np.random.default_rng(1).permutation(system.n_dof)[:n_boundary]
    rom = craig_bampton(system, {"boundary": rows}, n_mode)
    n = min(10, rom.n_dof)
    true = true_error(system, rom.modes(n).frequency)
    estimate = rom_error(system, rom, n)
    counts = true > FROM
    assert np.all(estimate[counts] <= FACTOR * true[counts])
    assert np.all(estimate[counts] >= true[counts] / FACTOR)
    # Where there is nothing to find nothing is found (the true error's own round-off is below the threshold).
    assert np.all(estimate[~counts] <= FACTOR * FROM)


def test_modes_that_the_boundary_cannot_see_are_missed_by_the_model_but_not_by_the_estimate() -> None:
    # Two chains that share nothing: the boundary lies on the first, the second's modes are truncated.
    chain = sp.diags_array([-np.ones(59), 2 * np.ones(60), -np.ones(59)], offsets=[-1, 0, 1]) * 100.0
    stiffness = sp.csr_array(sp.block_diag([chain, chain / 50]))
    system = LinearSystem(
        mass=sp.csr_array(sp.eye_array(120)),
        damping=sp.csr_array((120, 120)),
        stiffness=stiffness,
        free=np.arange(120),
        n_node=40,
    )
    rom = craig_bampton(system, {"end": np.array([0])}, n_mode=2)
    true = true_error(system, rom.modes(3).frequency)
    assert true[2] > 0.5  # the reduced third mode is another mode altogether
    np.testing.assert_allclose(rom_error(system, rom, 3)[2], true[2], rtol=0.5)


def test_a_model_with_all_modes_has_no_error() -> None:
    system = lattice(6, 5)
    rom = craig_bampton(system, {"boundary": np.array([1, 20])}, n_mode=100)
    assert np.all(rom_error(system, rom, 10) < 1e-12)  # round-off of a square root near one
    whole = craig_bampton(system, {"all": np.arange(30)})
    np.testing.assert_array_equal(rom_error(system, whole, 3), 0)


def test_the_estimate_does_not_depend_on_units_or_size() -> None:
    system = STRUCTURES["uniform"]
    # As of a screw in metres: shapes that its inertia makes have 1e-20 of the length of those of the membrane.
    small = replace(system, mass=sp.csr_array(1e-9 * system.mass), stiffness=sp.csr_array(1e8 * system.stiffness))
    rows = {"boundary": np.arange(5)}
    result = [rom_error(item, craig_bampton(item, rows, 10), 5) for item in (system, small)]
    assert result[0].min() > FROM
    # Settled to a tenth, each.
    np.testing.assert_allclose(result[1], result[0], rtol=0.1)


def test_rigid_body_motions_have_no_error() -> None:
    n = 60
    stiffness = sp.diags_array([-np.ones(n - 1), np.r_[1, 2 * np.ones(n - 2), 1], -np.ones(n - 1)], offsets=[-1, 0, 1])
    system = LinearSystem(
        mass=sp.csr_array(sp.eye_array(n)),
        damping=sp.csr_array((n, n)),
        stiffness=sp.csr_array(stiffness),
        free=np.arange(n),
        n_node=n // 3,
    )
    rom = craig_bampton(system, {"end": np.array([0])}, n_mode=6)
    estimate = rom_error(system, rom, 4)
    # Chain of n unit masses, free at both ends.
    exact = 2 * np.sin(np.arange(4) * np.pi / (2 * n)) / (2 * np.pi)
    assert estimate[0] == 0
    np.testing.assert_allclose(estimate[1:], rom.modes(4).frequency[1:] / exact[1:] - 1, rtol=0.2)


def test_a_model_of_another_system_is_refused() -> None:
    rom = craig_bampton(lattice(6, 5), {"boundary": np.array([1])}, n_mode=3)
    with pytest.raises(RomError, match="30 degrees of freedom was not made from this system of 42"):
        rom_error(lattice(7, 6), rom, 2)
    with pytest.raises(RomError, match="9 modes were requested from a reduced model of 4"):
        rom_error(lattice(6, 5), rom, 9)
