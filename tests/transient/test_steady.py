"""What a steady state is, when it is none, and how well its errors are known."""

import numpy as np
import pytest

from reduction.jointed_system import CubicSpring, ElasticStop, JenkinsElement, Joint, JointedSystem
from transient.errors import TransientError
from transient.integrate import integrate
from transient.state import start_from
from transient.steady import SteadyMotion, steady_motion


def oscillator(
    joint: Joint | None = None, damping: float = 0.0, force: complex = 1.0, static: float = 0.0
) -> JointedSystem:
    return JointedSystem(
        mass=np.eye(1),
        damping=np.array([[damping]]),
        stiffness=np.eye(1),
        joints=[] if joint is None else [joint],
        harmonic_force=np.array([[0], [force]]),
        static_load=np.array([static]),
    )


def jenkins(limit: float = 0.5) -> JenkinsElement:
    return JenkinsElement(name="jenkins", direction=np.ones(1), tangential_stiffness=1.0, limit_force=limit)


def test_linear_steady_state_is_the_receptance_with_its_phase() -> None:
    steady = steady_motion(oscillator(damping=0.1, force=1 - 0.5j, static=0.3), 1.1)
    assert steady.periodic
    # tolerance 1e-5 of the amplitude, in the norm of energy, is what is left of the transient.
    expected = [0.3, (1 - 0.5j) / (1 - 1.21 + 0.11j), 0]
    np.testing.assert_allclose(steady.coefficients(3)[:, 0], expected, atol=1e-5 * abs(expected[1]))


@pytest.mark.parametrize(("omega", "slack"), [(1.0, 0.5), (0.98, 0.05)], ids=["resonance", "beside it"])
def test_what_is_left_of_the_transient_is_bounded(omega: float, slack: float) -> None:
    # Beside resonance the transient turns against the excitation as it decays, and the bound is ten times too large.
    system = oscillator(damping=0.004)
    exact = 1 / (1 - omega**2 + 0.004j * omega)
    steady = steady_motion(system, omega, tolerance=1e-3, max_steps_per_period=256)
    error = abs(steady.coefficients(2)[1, 0] - exact) / abs(exact)
    assert steady.distance <= 1e-3
    assert slack * steady.distance < error < 1.01 * steady.distance


@pytest.mark.parametrize(
    "joint",
    [jenkins(), CubicSpring(name="c", direction=np.ones(1), stiffness=0.5)],
    ids=["jenkins", "cubic"],
)
def test_the_step_error_is_known_within_a_factor_of_two(joint: Joint) -> None:
    system, omega = oscillator(joint, damping=0.2), 1.3
    fine = steady_motion(system, omega, tolerance=1e-8, steps_per_period=8192, max_steps_per_period=8192)
    steady = steady_motion(
        system, omega, fine.start, tolerance=1e-8, step_tolerance=1e-9, steps_per_period=64, max_steps_per_period=128
    )
    swing = 0.5 * np.ptp(fine.samples)
    error = np.abs(steady.samples - fine.samples[::64]).max() / swing
    assert steady.steps_per_period == 128
    assert 0.5 * error < steady.step_error < 2 * error


def test_acceleration_reaches_the_same_motion_sooner() -> None:
    # The slider passes its whole loop in every period, so that there is one steady state only.
    system = oscillator(jenkins(0.1), damping=0.01, force=0.3)
    plain, fast = (
        steady_motion(system, 1.1, tolerance=1e-7, max_steps_per_period=256, acceleration=depth) for depth in (0, 8)
    )
    assert fast.n_period < 0.5 * plain.n_period
    # Both within the tolerance of the steady state.
    np.testing.assert_allclose(fast.samples, plain.samples, atol=1e-6 * np.abs(plain.samples).max())


def test_a_start_on_the_motion_with_its_slider_stays_there() -> None:
    # A sticking joint remembers: the motion depends on where its slider stands.
    system = oscillator(jenkins(50.0), damping=0.02)
    slider = np.array([0.7])
    exact = np.array([[0.35], [1 / (2 - 1.44 + 0.024j)]])
    steady = steady_motion(system, 1.2, start_from(system, 1.2, exact, slider))
    # No joint slips, so the step is exact, and the first periods already repeat.
    assert steady.n_period < 10
    np.testing.assert_allclose(steady.coefficients(2), exact, atol=1e-10)
    np.testing.assert_array_equal(steady.start.slider, slider)


def test_sliders_beyond_their_limit_are_moved_at_once() -> None:
    system = oscillator(jenkins(0.5), damping=0.02)
    start = start_from(system, 1.0, np.array([[2.0 + 0j]]), np.array([0.0]))
    assert integrate(system, 1.0, 1, 64, start).slider[0, 0] == pytest.approx(1.5, abs=1e-15)


def test_a_motion_of_two_periods_is_named() -> None:
    # Undamped, of half the frequency of the excitation, which does nothing.
    start = start_from(oscillator(), 2.0, np.array([[1.0 + 0j]]))
    steady = steady_motion(oscillator(force=0.0), 2.0, start)
    assert (steady.periodic, steady.period_multiple) == (False, 2)
    with pytest.raises(TransientError, match="repeats every 2 periods"):
        steady.coefficients(2)


def test_a_motion_that_does_not_repeat_is_named() -> None:
    start = start_from(oscillator(), 2.0, np.array([[1.0 + 0j]]))
    steady = steady_motion(oscillator(force=0.0), np.sqrt(3), start, max_period=60)
    assert steady.period_multiple == 0
    with pytest.raises(TransientError, match="does not repeat within 60 periods"):
        steady.coefficients(2)


def test_period_doubling_against_a_stop_is_named() -> None:
    # A light oscillator hit against a hard stop at twice the frequency of its bouncing: a bounce every other period.
    stop = ElasticStop(name="stop", direction=np.ones(1), stiffness=400.0, gap=0.0)
    steady = steady_motion(oscillator(stop, damping=0.1), 4.0, max_period=600)
    assert steady.period_multiple == 2, steady.message


def test_more_harmonics_than_samples_are_refused() -> None:
    steady: SteadyMotion = steady_motion(oscillator(damping=0.5), 1.0, steps_per_period=16, max_steps_per_period=16)
    with pytest.raises(TransientError, match="n_harmonic = 9 must lie between 1 and 8"):
        steady.coefficients(9)
