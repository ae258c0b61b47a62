"""Functions of a free law: against closed forms, and as joints of a model."""

import numpy as np
import pytest

from diagnosis.missing_law.basis import GROUPS, N_INSTANT, SLIDES, LawBasis, find_harmonics, follow
from diagnosis.missing_law.law_joints import list_law_joints
from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from reduction.jointed_system import JointedSystem

BASIS, OMEGA = LawBasis(reach=2e-3, speed=0.5), 250.0
THETA = 2 * np.pi * np.arange(N_INSTANT) / N_INSTANT


def motion(amplitude: float) -> tuple[np.ndarray, np.ndarray]:
    return follow(np.array([[0.0, amplitude]], dtype=complex), np.array([OMEGA]))


def test_motions_are_cosines() -> None:
    u, v = motion(1e-3)
    np.testing.assert_allclose(u[0], 1e-3 * np.cos(THETA), atol=1e-15)
    np.testing.assert_allclose(v[0], -OMEGA * 1e-3 * np.sin(THETA), atol=1e-12)


@pytest.mark.parametrize("cell", range(len(SLIDES)))
def test_the_work_of_a_cell_is_that_of_a_sliding_spring(cell: int) -> None:
    """4 F (A - d): beyond its slip the cell goes up and down with its limit F."""
    u, v = motion(BASIS.reach)
    force = BASIS.forces(u, v)[0, :, BASIS.group == GROUPS.index("memory")][cell]
    work = -2 * np.pi / N_INSTANT * force @ np.sin(THETA) * BASIS.reach
    # Sums over 128 instants of loops with corners.
    assert np.isclose(work, 4 * (BASIS.reach - SLIDES[cell] * BASIS.reach), rtol=0.02)


def test_curved_functions_are_odd_and_even_and_flat_at_zero() -> None:
    u = np.array([[-1e-3, -1e-6, 1e-6, 1e-3]])
    forces = BASIS.forces(u, np.zeros_like(u))[0]
    odd, even = (forces[:, BASIS.group == GROUPS.index(name)] for name in ("odd spring", "even spring"))
    np.testing.assert_allclose(odd[::-1], -odd)
    np.testing.assert_allclose(even[::-1], even)
    # Of the first piece, that has the slope of the first knot, where the process has hardly begun.
    assert np.abs(even[1:3]).max() < 1e-3 * np.abs(even).max()


def test_the_variance_before_any_data_is_that_of_an_integrated_wiener_process() -> None:
    x = np.arange(1, len(BASIS.curved) + 1) / len(BASIS.curved)
    # The left out functions have 1e-6 of the largest eigenvalue.
    np.testing.assert_allclose((BASIS.curved**2).sum(axis=1), x**3, atol=1e-5)


def test_the_joints_have_the_force_of_the_functions() -> None:
    random = np.random.default_rng(1)
    values = random.normal(size=len(BASIS.group))
    values[BASIS.is_positive] = np.abs(values[BASIS.is_positive])
    joints = list_law_joints("law", np.ones(1), BASIS, values)
    force = np.zeros((2, 1), dtype=complex)
    force[1] = 40.0
    system = JointedSystem(
        mass=np.array([[0.5]]), damping=np.array([[20.0]]), stiffness=np.array([[6e4]]), joints=joints,
        harmonic_force=force,
    )  # fmt: skip
    balance = HarmonicBalance(system=system, n_harmonic=12, n_sample=512)
    state = steady_state(balance, OMEGA)
    u, v = follow(state.coefficients.T[:, :12], np.array([OMEGA]))
    result = find_harmonics(BASIS.forces(u, v) @ values[:, None], 4)[0, :, 0]
    # What the mass lacks for its balance is the force of the joints.
    k = np.arange(4)
    linear = 6e4 - 0.5 * (k * OMEGA) ** 2 + 20j * k * OMEGA
    needed = np.r_[0, 40.0, 0, 0] - linear * state.coefficients[:4, 0]
    # Kinks between instants.
    np.testing.assert_allclose(result, needed, atol=0.02 * np.abs(needed).max())
