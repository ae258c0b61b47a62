"""Harmonics and samples that a tolerance needs, against many more of both and against time integration."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.refined_branch import branch_errors, refine_branch
from hbsolve.continuation.response import frequency_response, joint_response
from hbsolve.errors import BalanceError
from hbsolve.refinement import MARGIN, RefinementStop, refine_harmonics
from hbsolve.solution import newton_from
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from hbsolve.truncation import compute_relative_change, truncation
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    JointedSystem,
    SmoothFriction,
)
from transient.steady import steady_motion

#: Coarse H, and over it that of the truth: half as many again as the most that a refinement takes, 8 times.
HIGHEST, TIMES = 5, 12


def chain(n: int, *joints: Joint, force: float = 10.0, damping_ratio: float = 0.002) -> JointedSystem:
    """Masses of 1 kg between walls and springs of 1e6 N/m; the first is driven."""
    stiffness = 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    lowest = np.sqrt(np.linalg.eigvalsh(stiffness)[0])
    load = np.zeros((2, n))
    load[1, 0] = force
    return JointedSystem(
        mass=np.eye(n), damping=2 * damping_ratio / lowest * stiffness, stiffness=stiffness, joints=joints,
        harmonic_force=load,
    )  # fmt: skip


def end(n: int) -> NDArray[np.float64]:
    return np.eye(n)[n - 1]


SLIDER = JenkinsElement(name="slider", direction=end(3), tangential_stiffness=2e7, limit_force=10.0)
STOP = ElasticStop(name="stop", direction=end(3), stiffness=1e7, gap=1e-5)
PAD = FrictionContact(
    name="pad", normal=0.5 * end(4), tangents=np.eye(4)[1:3], normal_stiffness=2e6, tangential_stiffness=1e6,
    friction_coefficient=0.4, preload=8.0, friction=Friction.COULOMB,
)  # fmt: skip
CUBIC = CubicSpring(name="cubic", direction=end(3), stiffness=1e17)
SYSTEMS = {
    "sticks and slips": (chain(3, SLIDER), 826.0),
    "lifts off": (chain(3, STOP), 760.0),
    "two coupled tangents": (chain(4, PAD, force=40.0), 660.0),
    "Duffing": (chain(3, CUBIC), 700.0),
}


def true_error(balance: HarmonicBalance, state: SteadyState, rows: NDArray[np.float64]) -> float:
    """Largest relative error of the fundamental of the rows."""
    finest = balance.with_harmonics(max(TIMES * HIGHEST, 4 * (balance.n_harmonic - 1)) + 1, 4096)
    motion = np.zeros((finest.n_direction, 2 * finest.n_harmonic - 1))
    motion[:, : state.motion.shape[1]] = state.motion
    exact = newton_from(finest, finest.at(state.angular_frequency), motion, state.sliders)
    assert exact is not None
    q = state.coefficients[1]
    return float(compute_relative_change(balance, exact.coefficients[1] - q, q, rows).max())


@pytest.mark.parametrize("system", SYSTEMS)
def test_the_estimate_of_each_mass_is_its_error_within_the_margin(system: str) -> None:
    of, omega = SYSTEMS[system]
    balance = HarmonicBalance(system=of, n_harmonic=HIGHEST + 1)
    state = steady_state(balance, omega)
    for row in np.eye(of.n_dof)[:, None]:
        error = true_error(balance, state, row)
        estimate = compute_relative_change(balance, truncation(balance, state).change, state.coefficients[1], row)[0]
        assert error > 1e-7  # a hundred residuals
        assert error / MARGIN < estimate < MARGIN * error


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_a_refined_state_is_right_to_the_tolerance(system: str, tolerance: float) -> None:
    of, omega = SYSTEMS[system]
    balance = HarmonicBalance(system=of, n_harmonic=HIGHEST + 1)
    rows = np.eye(of.n_dof)
    refined = refine_harmonics(balance, steady_state(balance, omega), tolerance, rows=rows)
    assert refined.stop is RefinementStop.TOLERANCE
    assert refined.error <= tolerance
    assert true_error(balance, refined.state, rows) < tolerance


def test_a_stop_that_is_hit_is_right_to_the_tolerance_beside_time_integration() -> None:
    # Damped so that one steady state attracts every motion.
    of, omega = chain(3, STOP, damping_ratio=0.02), 720.0
    balance = HarmonicBalance(system=of, n_harmonic=HIGHEST + 1)
    refined = refine_harmonics(balance, steady_state(balance, omega), 1e-3, rows=np.eye(3))
    assert refined.stop is RefinementStop.TOLERANCE
    motion = steady_motion(of, omega, tolerance=2e-5, steps_per_period=1024, max_steps_per_period=1024)
    exact = motion.coefficients(2)[1]
    # The tolerance, and 0.03 % of the steps of the integration.
    np.testing.assert_allclose(refined.state.coefficients[1], exact, rtol=0, atol=1.3e-3 * np.abs(exact).max())


def test_what_does_not_reach_the_tolerance_says_so() -> None:
    of, omega = SYSTEMS["sticks and slips"]
    balance = HarmonicBalance(system=of, n_harmonic=2)
    state = steady_state(balance, omega)
    refined = refine_harmonics(balance, state, 1e-6, most=3)
    assert (refined.stop, refined.balance.n_harmonic) == (RefinementStop.MOST_HARMONICS, 4)
    assert refined.error > 1e-6
    kept = refine_harmonics(balance, state, 1e-6, most=1)
    assert (kept.stop, kept.state) == (RefinementStop.MOST_HARMONICS, state)
    estimated = MARGIN * truncation(balance, state).change
    np.testing.assert_array_equal(kept.change, estimated)


def test_the_first_mass_of_a_rubbing_chain_is_seen_to_be_4_percent_off_with_7_harmonics() -> None:
    of, omega = SYSTEMS["sticks and slips"]
    balance = HarmonicBalance(system=of, n_harmonic=8)
    state, row = steady_state(balance, omega), np.eye(3)[:1]
    error = true_error(balance, state, row)
    estimate = compute_relative_change(balance, truncation(balance, state).change, state.coefficients[1], row)[0]
    assert error == pytest.approx(0.045, abs=0.003)
    assert error / MARGIN < estimate < MARGIN * error


def test_a_difference_of_motions_far_from_a_stop_is_seen_to_be_off_with_20_harmonics_where_the_stop_is_not() -> None:
    stop = ElasticStop(name="stop", direction=np.eye(4)[2], stiffness=8.43e7, gap=1.65e-6)
    balance = HarmonicBalance(system=chain(4, stop), n_harmonic=21)
    state = steady_state(balance, 470.0)
    q = state.coefficients[1]
    # Two sensors whose readings nearly cancel.
    row = np.array([[1.0, -0.99 * (q[0] / q[1]).real, 0.0, 0.0]])
    estimate = truncation(balance, state)
    error = true_error(balance, state, row)
    assert estimate.harmonics < 0.05 < 0.2 < error
    assert error / MARGIN < compute_relative_change(balance, estimate.change, q, row)[0] < MARGIN * error


def test_points_of_a_branch_have_the_harmonics_that_they_need() -> None:
    of, _ = SYSTEMS["sticks and slips"]
    balance = HarmonicBalance(system=of, n_harmonic=HIGHEST + 1)
    rows, tolerance = np.eye(3)[:1], 3e-3
    coarse = frequency_response(balance, 740.0, 860.0, step=10.0)
    refined = refine_branch(balance, coarse, tolerance, rows=rows)
    np.testing.assert_array_equal(refined.angular_frequency, coarse.angular_frequency)
    assert len(set(refined.highest_harmonic)) > 1
    assert branch_errors(balance, refined, rows).max() <= tolerance
    for index, highest in enumerate(refined.highest_harmonic.astype(int)):
        assert not refined.coefficients[index, highest + 1 :].any()
        if highest == HIGHEST:
            np.testing.assert_array_equal(refined.coefficients[index, : HIGHEST + 1], coarse.coefficients[index])
        assert true_error(refined.balance_at(balance, index), refined.state(balance, index), rows) < tolerance


def test_what_cannot_be_refined_is_refused() -> None:
    balance = HarmonicBalance(system=SYSTEMS["sticks and slips"][0], n_harmonic=2)
    state = steady_state(balance, 826.0)
    with pytest.raises(BalanceError, match="tolerance = 0 must be positive"):
        refine_harmonics(balance, state, 0.0)
    with pytest.raises(BalanceError, match=r"rows have shape \(3,\): give \(n, 3\)"):
        refine_harmonics(balance, state, 0.1, rows=np.ones(3))
    branch = frequency_response(balance, 810.0, 830.0)
    with pytest.raises(BalanceError, match="no estimated_change"):
        refine_branch(balance, replace(branch, estimated_change=np.zeros((0, 0), dtype=complex)), 0.1)
    over_stiffness = joint_response(balance, 826.0, "slider", "limit_force", 10.0, 12.0)
    with pytest.raises(BalanceError, match="of the linear motion: give the balance and the sliders"):
        refine_branch(balance, over_stiffness, 1e-6)


def test_a_force_that_steps_between_samples_is_not_judged_on_them() -> None:
    """Friction that is steep in the velocity: on 256 samples twice the harmonics seem to change nothing."""
    steep = SmoothFriction(name="steep", direction=np.ones(1), limit_force=0.8, velocity=1e-5)
    system = JointedSystem(
        mass=[[1.0]], damping=[[2.0]], stiffness=[[1e4]], joints=[steep], harmonic_force=[[0], [1.0]]
    )
    coarse = HarmonicBalance(system=system, n_harmonic=8)
    fine = HarmonicBalance(system=system, n_harmonic=60, n_sample=8192)
    state, exact = (steady_state(balance, 90.0) for balance in (coarse, fine))
    error = abs(state.amplitude(0) / exact.amplitude(0) - 1)
    assert error > 0.2
    assert truncation(coarse, state).harmonics > error / 2
