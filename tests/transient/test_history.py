"""What joints remember of static loads and levels, against closed forms of spring and slider."""

import numpy as np
import pytest

from reduction.jointed_system import FrictionContact, JenkinsElement, JointedSystem
from transient.equilibrium import equilibrium
from transient.history import Segment, follow
from transient.integrate import integrate

#: A clock so slow that an overdamped mass (c^2 > 4 (k + kt)) follows its equilibrium.
SLOW = 2 * np.pi / 1000

STIFFNESS, TANGENTIAL, LIMIT = 2.0, 3.0, 0.6


def spring_and_slider() -> JointedSystem:
    return JointedSystem(
        mass=np.eye(1),
        damping=np.array([[6.0]]),
        stiffness=np.array([[STIFFNESS]]),
        joints=[JenkinsElement(name="j", direction=np.ones(1), tangential_stiffness=TANGENTIAL, limit_force=LIMIT)],
        static_load=np.array([1.0]),
        harmonic_force=np.array([[0], [0.1]]),
    )


def ramps(*loads: float) -> list[Segment]:
    """Each load reached slowly and held."""
    return [
        Segment(n_period=1, angular_frequency=SLOW, level=0.0, load=load)
        for reached in loads
        for load in (reached, reached)
    ]


def test_an_overshoot_leaves_the_slider_where_the_closed_form_says() -> None:
    # Loading to f slides to q = (f - mu N)/k; unloading to zero sticks: (k + kt) q = kt w.
    peak = 2.0
    slider = (peak - LIMIT) / STIFFNESS - LIMIT / TANGENTIAL
    state = follow(spring_and_slider(), ramps(peak, 0.0), first_load=0.0, steps_per_period=2048)
    # The dwell of 1,000 s against a decay of 3 s leaves nothing of the lag on the ramp.
    assert state.slider[0] == pytest.approx(slider, abs=1e-9)
    assert state.displacement[0] == pytest.approx(TANGENTIAL * slider / (STIFFNESS + TANGENTIAL), abs=1e-9)


def test_ramp_and_equilibrium_agree_on_the_way_up() -> None:
    system = spring_and_slider()
    static, moved = equilibrium(system, 1.5), follow(system, ramps(1.5), first_load=0.0, steps_per_period=2048)
    np.testing.assert_allclose(moved.displacement, static.displacement, atol=1e-9)
    np.testing.assert_allclose(moved.slider, static.slider, atol=1e-9)
    assert static.displacement[0] == pytest.approx((1.5 - LIMIT) / STIFFNESS, rel=1e-12)


def test_equilibrium_of_a_preloaded_contact() -> None:
    # N = N0 + kn v pushes back: (k + kn) v = f - N0, and the tangent slides at mu N.
    system = JointedSystem(
        mass=np.eye(2),
        damping=np.zeros((2, 2)),
        stiffness=np.diag([4.0, 4.0]),
        joints=[
            FrictionContact(
                name="c",
                tangents=np.array([[1.0, 0.0]]),
                normal=np.array([0.0, 1.0]),
                normal_stiffness=6.0,
                tangential_stiffness=10.0,
                friction_coefficient=0.3,
                preload=2.0,
            )
        ],
        static_load=np.array([3.0, 1.0]),
    )
    state = equilibrium(system)
    v = (1.0 - 2.0) / 10.0
    normal = 2.0 + 6.0 * v
    q = (3.0 - 0.3 * normal) / 4.0
    np.testing.assert_allclose(state.displacement, [q, v], rtol=1e-12)
    assert state.slider[0] == pytest.approx(q - 0.3 * normal / 10.0, rel=1e-12)
    after = integrate(system, 1.0, 2, 64, state).final
    np.testing.assert_allclose(after.displacement, state.displacement, rtol=1e-11)


def test_a_constant_history_is_a_plain_integration() -> None:
    system = spring_and_slider()
    segment = Segment(n_period=4, angular_frequency=1.0, level=1.0)
    history = follow(system, [segment], first_level=1.0, steps_per_period=64)
    plain = integrate(system, 1.0, 4, 64).final
    np.testing.assert_allclose(history.displacement, plain.displacement, rtol=1e-12)
    np.testing.assert_allclose(history.slider, plain.slider, rtol=1e-12)


def test_a_ramp_of_the_level_converges_with_order_two() -> None:
    segments = [
        Segment(n_period=2, angular_frequency=1.3, level=30.0),
        Segment(n_period=1, angular_frequency=1.3, level=2.0),
    ]
    system = spring_and_slider()
    states = [follow(system, segments, steps_per_period=n) for n in (64, 128, 256, 512, 8192)]
    errors = [abs(state.displacement[0] - states[-1].displacement[0]) for state in states[:-1]]
    # Three halvings: 64, with scatter from slip that begins within a step.
    assert 25 < errors[0] / errors[3] < 160
