"""A body that joints alone hold: where all of them slip it vibrates about no place of its own, and does not drift."""

from dataclasses import replace

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response, level_response
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import Failure, NoSteadyState
from hbsolve.free_body import is_free
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.response_limits import limit_problem
from hbsolve.steady_state import steady_state
from reduction.jointed_system import (
    DampedStop,
    ElasticStop,
    FrictionContact,
    HertzContact,
    JenkinsElement,
    Joint,
    JointedSystem,
)
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


def test_a_curve_ends_where_a_mean_of_friction_begins_to_push() -> None:
    # All stick up to the limit force; beyond it the body slips one way further than the other.
    curve = level_response(balance(1.0, second=2.0), 60.0, 0.05, 1.0)
    assert curve.stop_reason is StopReason.DRIFTED
    time = np.linspace(0, 2 * np.pi, 1000)
    stuck = np.exp(1j * np.outer(time, np.arange(curve.coefficients.shape[1]))) @ curve.coefficients[-1, :, 0]
    assert 3e4 * np.abs(stuck.real).max() == pytest.approx(1.0, rel=0.1)


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
    joint = np.diag([1e4, 0.0])
    assert is_free(PAIR, joint)
    assert is_free(np.zeros((1, 1)), np.ones((1, 1)))
    assert not is_free(PAIR + np.diag([0.0, 1.0]), joint)
    assert not is_free(np.diag([1.0, 1e14]), joint)


@pytest.mark.parametrize("level", [0.0, 1e-4, 1e-2])
def test_a_body_between_preloaded_contacts_is_at_rest_off_its_place(level: float) -> None:
    contacts = [
        FrictionContact(name=name, tangents=np.array([0.0, 1.0]), normal=np.array([sign, 0.0]),
                        tangential_stiffness=1e6, normal_stiffness=1e6, friction_coefficient=0.5, preload=preload)
        for name, sign, preload in (("left", 1.0, 100.0), ("right", -1.0, 120.0))
    ]  # fmt: skip
    system = JointedSystem(mass=np.eye(2), damping=np.eye(2), stiffness=np.zeros((2, 2)), joints=contacts,
                           harmonic_force=[[0, 0], [1.0, 1.0]])  # fmt: skip
    state = steady_state(HarmonicBalance(system=system, n_harmonic=5, level=level), 100.0)
    assert state.coefficients[0, 0].real == pytest.approx(1e-5)  # (120 N - 100 N) / 2e6 N/m


@pytest.mark.parametrize(
    ("stop", "stiffness", "damping"),
    [
        (ElasticStop(name="s", direction=np.ones(1), stiffness=1e4, gap=-1e-3), 1e4, 0.0),
        (DampedStop(name="s", direction=np.ones(1), stiffness=1e4, damping=20.0, depth=1e-4, gap=-1e-3), 1e4, 20.0),
        (HertzContact(name="s", direction=np.ones(1), stiffness=1e4, reference=1e-3, gap=-1e-3), 1.5e4, 0.0),
    ],
    ids=["stop", "damped stop", "Hertz"],
)
def test_a_body_that_is_pressed_onto_a_stop_vibrates_on_its_tangent(
    stop: Joint, stiffness: float, damping: float
) -> None:
    system = JointedSystem(mass=[[1.0]], damping=[[5.0]], stiffness=[[0.0]], joints=[stop], static_load=[10.0],
                           harmonic_force=[[0], [1e-2]])  # fmt: skip
    state = steady_state(HarmonicBalance(system=system, n_harmonic=4), 50.0)
    exact = 1e-2 / (stiffness - 50.0**2 + 1j * 50.0 * (5.0 + damping))
    assert state.coefficients[1, 0] == pytest.approx(exact, rel=1e-5)  # (1e-6 m of vibration over 1 mm)^2
    assert abs(state.coefficients[0, 0]) < 1e-8  # 10 N press it by 1 mm; Hertz's curve moves the mean by A^2 / mm


def test_a_held_body_that_shares_a_structure_is_at_rest_where_it_is_pushed() -> None:
    slider = JenkinsElement(name="j", direction=np.ones(1), tangential_stiffness=1e9, limit_force=1.0)
    system = JointedSystem(mass=[[1.0]], damping=[[10.0]], stiffness=[[1e5]], joints=[slider], static_load=[100.0],
                           harmonic_force=[[0], [1e-3]])  # fmt: skip
    balance = HarmonicBalance(system=system, n_harmonic=5)
    shared = balance.on_same_structure(replace(system, joints=[slider.with_values({"limit_force": 2.0})]))
    assert steady_state(shared, 50.0).coefficients[0, 0].real == pytest.approx(98.0 / 1e5, rel=1e-3)


def test_a_static_load_above_the_limit_force_has_no_rest() -> None:
    """Only the springs that centre the body hold it, 1e5 m away; limits have no state to be about."""
    slider = JenkinsElement(name="j", direction=np.ones(1), tangential_stiffness=1e4, limit_force=1.0)
    system = JointedSystem(mass=[[1.0]], damping=[[5.0]], stiffness=[[0.0]], joints=[slider], static_load=[2.0],
                           harmonic_force=[[0], [0.1]])  # fmt: skip
    balance = HarmonicBalance(system=system, n_harmonic=4)
    with pytest.raises(NoSteadyState) as refused:
        steady_state(balance.at_level(0.0), 50.0)
    assert refused.value.failure is Failure.DRIFT
    with pytest.raises(NoSteadyState):
        limit_problem(balance, OutputHarmonic(row=0))


def test_a_static_load_below_the_limit_force_is_held() -> None:
    slider = JenkinsElement(name="j", direction=np.ones(1), tangential_stiffness=1e4, limit_force=1.0)
    system = JointedSystem(mass=[[1.0]], damping=[[5.0]], stiffness=[[0.0]], joints=[slider], static_load=[0.9],
                           harmonic_force=[[0], [0.1]])  # fmt: skip
    state = steady_state(HarmonicBalance(system=system, n_harmonic=4, level=0.0), 50.0)
    assert state.coefficients[0, 0].real == pytest.approx(0.9 / 1e4)
