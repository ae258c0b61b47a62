"""A body that joints alone hold: where all of them slip it vibrates about no place of its own, and does not drift."""

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response, level_response
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import Failure, NoSteadyState
from hbsolve.free_body import is_free
from hbsolve.steady_state import steady_state
from reduction.jointed_system import JenkinsElement, JointedSystem
from transient.steady import steady_motion

PAIR = np.array([[1e4, -1e4], [-1e4, 1e4]])


def balance(limit: float, second: float = 0.0) -> HarmonicBalance:
    slider = JenkinsElement(name="j", direction=np.array([1.0, 0.0]), tangential_stiffness=3e4, limit_force=limit)
    force = [[0, 0], [5.0, 0], [second, 0]]
    system = JointedSystem(mass=np.eye(2), damping=np.eye(2), stiffness=PAIR, joints=[slider], harmonic_force=force)
    return HarmonicBalance(system=system, n_harmonic=9, n_sample=1024)


@pytest.mark.parametrize("limit", [8.0, 3.0, 1.0])
def test_gross_slip_has_the_amplitude_of_time_integration(limit: float) -> None:
    state = steady_state(balance(limit), 170.0)
    assert abs(state.coefficients[0, 0]) < 1e-3
    motion = steady_motion(
        balance(limit).system, 170.0, tolerance=1e-6, steps_per_period=1024, max_steps_per_period=1024
    )
    # The truncation at H = 8.
    assert state.amplitude(0) == pytest.approx(abs(motion.coefficients(2)[1, 0]), rel=1e-3)


def test_a_curve_passes_where_all_slip() -> None:
    assert frequency_response(balance(3.0), 40.0, 170.0).stop_reason is StopReason.REACHED


def test_a_body_that_a_mean_of_friction_pushes_on_has_no_steady_state() -> None:
    with pytest.raises(NoSteadyState) as refused:
        steady_state(balance(1.0, second=2.0), 170.0)
    assert refused.value.failure is Failure.DRIFT


@pytest.mark.parametrize("last", [0.0, -1.0])
def test_a_level_falls_to_zero_and_through_it(last: float) -> None:
    slider = JenkinsElement(name="a", direction=np.ones(1), tangential_stiffness=3e4, limit_force=2.0)
    system = JointedSystem(
        mass=[[1.0]], damping=[[20.0]], stiffness=[[1e4]], joints=[slider], harmonic_force=[[0], [10.0]]
    )
    curve = level_response(HarmonicBalance(system=system, n_harmonic=8), 130.0, 1.0, last)
    assert curve.stop_reason is StopReason.REACHED
    assert curve.level[-1] == last


def test_what_is_free() -> None:
    assert is_free(PAIR)
    assert is_free(np.zeros((2, 2)))
    assert not is_free(PAIR + np.diag([0.0, 1e-3]))
    assert not is_free(np.diag([1.0, 1e14]))
