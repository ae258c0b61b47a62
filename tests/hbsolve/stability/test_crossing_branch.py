"""Branches that cross at a branch point: against two equations of one harmonic and against the integration in time."""

import numpy as np
import pytest
from scipy.optimize import root

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.response import frequency_response
from hbsolve.errors import BalanceError
from hbsolve.stability.branch_stability import Bifurcation, branch_stability
from hbsolve.stability.crossing_branch import crossing_branches
from hbsolve.stability.stability import stability
from reduction.jointed_system import CubicSpring, JointedSystem
from tests.slow import slow
from transient.state import start_from
from transient.steady import steady_motion

STIFFNESS, COUPLING, DAMPING, CUBIC, LOAD = 1.0, 0.05, 0.03, 0.5, 0.2


def twins() -> JointedSystem:
    """Two equal masses on hardening springs, weakly coupled, under equal forces: they need not move alike."""
    joints = [CubicSpring(name=f"cubic {number}", direction=np.eye(2)[number], stiffness=CUBIC) for number in range(2)]
    stiffness = STIFFNESS * np.eye(2) + COUPLING * np.array([[1, -1], [-1, 1]])
    return JointedSystem(
        mass=np.eye(2), damping=DAMPING * np.eye(2), stiffness=stiffness, joints=joints,
        harmonic_force=[[0.0, 0.0], [LOAD, LOAD]],
    )  # fmt: skip


def balance_left(z: np.ndarray, omega: float) -> np.ndarray:
    """Harmonic balance of one harmonic of each mass, written without the solver: k_eff a + 3/4 c |a|^2 a = F."""
    a, b = z[0] + 1j * z[1], z[2] + 1j * z[3]
    linear = STIFFNESS + COUPLING - omega**2 + 1j * omega * DAMPING
    left = [
        linear * a - COUPLING * b + 0.75 * CUBIC * abs(a) ** 2 * a - LOAD,
        linear * b - COUPLING * a + 0.75 * CUBIC * abs(b) ** 2 * b - LOAD,
    ]
    return np.array([part for item in left for part in (item.real, item.imag)])


def find_crossings(balance: HarmonicBalance) -> list[tuple[ResponseBranch, ...]]:
    """Crossing branches of each branch point of the branch on which both masses move alike."""
    branch = frequency_response(balance, 0.7, 2.2, step=0.02)
    points = branch_stability(balance, branch, n_sample=512).bifurcations
    return [crossing_branches(balance, branch, item) for item in points if item.kind is Bifurcation.BRANCH_POINT]


@slow
def test_masses_that_need_not_move_alike_have_two_mirrored_branches() -> None:
    balance = HarmonicBalance(system=twins(), n_harmonic=2)
    branch = frequency_response(balance, 0.7, 2.2, step=0.01)
    points = [item for item in branch_stability(balance, branch).bifurcations if item.kind is Bifurcation.BRANCH_POINT]
    assert points
    one, other = crossing_branches(balance, branch, points[0], step=0.02)
    # Mirror images, point by point: rounding of two continuations.
    np.testing.assert_allclose(one.coefficients, other.coefficients[:, :, ::-1], rtol=0, atol=1e-7)
    apart = np.abs(one.output(0) - one.output(1))
    assert apart[0] < 1e-3 * apart.max()
    for index in np.linspace(1, len(one.frequency) - 1, 7).astype(int).tolist():
        omega, a, b = one.angular_frequency[index], one.output(0)[index], one.output(1)[index]
        begin = np.array([a.real, a.imag, b.real, b.imag])
        solved = root(balance_left, begin, args=(omega,), tol=1e-13)
        # Newton's tolerance of the balance, 1e-9 of the motion.
        np.testing.assert_allclose(solved.x, begin, rtol=0, atol=1e-8)


@slow
def test_a_stable_state_on_the_crossing_branch_is_that_of_the_integration_in_time() -> None:
    system = twins()
    balance = HarmonicBalance(system=system, n_harmonic=8)
    crossing = [item for one in find_crossings(balance) for item in one]
    states = [item.state(balance, index) for item in crossing for index in range(1, len(item.frequency), 20)]
    apart = [item for item in states if abs(np.subtract(*item.coefficients[1])) > 0.5 * abs(item.coefficients[1, 0])]
    stable = [item for item in apart if stability(balance, item, n_sample=512).is_stable]
    assert stable
    state = stable[len(stable) // 2]
    start = start_from(system, state.angular_frequency, state.coefficients)
    motion = steady_motion(system, state.angular_frequency, start)
    assert motion.period_multiple == 1
    # The integration takes steps whose error it estimates below 1e-3.
    np.testing.assert_allclose(motion.coefficients(2)[1], state.coefficients[1], rtol=2e-3)


def test_other_bifurcations_have_none() -> None:
    balance = HarmonicBalance(system=twins(), n_harmonic=3)
    branch = frequency_response(balance, 0.7, 2.2, step=0.02)
    folds = [
        item for item in branch_stability(balance, branch, n_sample=512).bifurcations if item.kind is Bifurcation.FOLD
    ]
    with pytest.raises(BalanceError, match="branch point"):
        crossing_branches(balance, branch, folds[0])
