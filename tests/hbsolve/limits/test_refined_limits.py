"""Limits with more harmonics, against many more harmonics and samples at the same sliders."""

from dataclasses import replace

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.errors import BalanceError
from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.objective import ContactForceHarmonic, OutputHarmonic
from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.refined_limits import refine_limits
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.result import REFINED, ResponseLimits, read_limits_from_xarray
from hbsolve.limits.search import LimitSettings
from hbsolve.solution import newton_from
from hbsolve.state import SteadyState, in_harmonics_of
from reduction.jointed_system import JointedSystem

#: All contacts stick at the first frequency, where the response is linear; at the second they slip.
OMEGA = 2 * np.pi * 284.0 * np.array([0.97, 0.98])
QUICK = LimitSettings(population=3, sample=0, frequencies=1)
TOLERANCE = 2e-3
CONTACTS = ("blade 1", "blade 2")


@pytest.fixture(scope="module")
def amplitude(wedge: JointedSystem) -> LimitProblem:
    return limit_problem(HarmonicBalance(system=wedge, n_harmonic=5), OutputHarmonic(row=0))


@pytest.fixture(scope="module")
def limits(amplitude: LimitProblem) -> ResponseLimits:
    return response_limits(amplitude, OMEGA, [0.4], settings=QUICK)


def exact_state(
    problem: LimitProblem, limits: ResponseLimits, side: int, at: int
) -> tuple[HarmonicBalance, SteadyState]:
    """Three times as many harmonics as a refinement takes at most."""
    finest = problem.balance.at_level(0.4).with_harmonics(97, 8192)
    state = limits.state(problem.balance, list(LimitSide)[side], 0, at)
    result = newton_from(
        finest, finest.at(state.angular_frequency), in_harmonics_of(finest, state.motion), state.sliders
    )
    assert result is not None
    return finest, result


def test_a_refined_amplitude_is_right_to_the_tolerance(amplitude: LimitProblem, limits: ResponseLimits) -> None:
    steps: list[tuple[float, float]] = []
    refined = refine_limits(
        amplitude, limits, TOLERANCE, rows=np.eye(4)[:1], report=lambda done, total: steps.append((done, total))
    )
    assert steps == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert (refined.refined_error <= TOLERANCE).all()
    exact = np.array([[exact_state(amplitude, limits, side, at)[1].amplitude(0) for at in (0, 1)] for side in (0, 1)])
    np.testing.assert_allclose(refined.refined[:, 0], exact, rtol=TOLERANCE)
    np.testing.assert_array_equal(refined.best_value, refined.refined)
    # Without refinement one of them would not be.
    assert np.abs(limits.value[:, 0] / exact - 1).max() > TOLERANCE
    change = np.abs(refined.refined / limits.value - 1)
    np.testing.assert_array_equal(refined.refined_moved, change > 2 * TOLERANCE)
    assert {*refined.refined_moved.ravel().tolist()} == {False, True}
    # What was searched for is as it was.
    np.testing.assert_array_equal(refined.value, limits.value)


@pytest.mark.parametrize("direction", [0, -1])
def test_a_refined_force_of_a_line_is_right_to_the_tolerance(amplitude: LimitProblem, direction: int) -> None:
    force = replace(amplitude, objective=ContactForceHarmonic(joints=CONTACTS, direction=direction))
    limits = response_limits(force, OMEGA[1:], [0.4], settings=QUICK)
    refined = refine_limits(force, limits, TOLERANCE)
    assert (refined.refined_error <= TOLERANCE).all()
    assert (refined.refined_harmonic >= 8).all()
    for side in (0, 1):
        finest, state = exact_state(force, limits, side, 0)
        exact = sum(item.force[direction].mean() for item in contact_motion(finest, state) if item.name in CONTACTS)
        # A force near zero is right to the tolerance of the loads, 30 N.
        assert refined.refined[side, 0, 0] == pytest.approx(exact, rel=TOLERANCE, abs=0.01 * 30 * TOLERANCE)


def test_limits_that_are_good_enough_stay_as_they_are(amplitude: LimitProblem, limits: ResponseLimits) -> None:
    refined = refine_limits(amplitude, limits, 0.5, rows=np.eye(4)[:1])
    # Newton's method stops at 1e-9 of the linear motion.
    np.testing.assert_allclose(refined.refined, limits.value, rtol=1e-7)
    assert (refined.refined_harmonic == 4).all()
    missing = replace(limits, value=np.full_like(limits.value, np.nan))
    assert np.isnan(refine_limits(amplitude, missing, 0.5).refined).all()
    with pytest.raises(BalanceError, match=r"tolerance = 0 must be positive"):
        refine_limits(amplitude, limits, 0.0)


def test_older_files_hold_limits_that_are_not_refined(limits: ResponseLimits) -> None:
    data = limits.to_xarray().drop_vars(list(REFINED))
    older = read_limits_from_xarray(data)
    np.testing.assert_array_equal(older.best_value, limits.value)
    assert not older.refined_moved.any()
