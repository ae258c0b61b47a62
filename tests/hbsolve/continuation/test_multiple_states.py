"""All steady states of oscillators whose states can be counted."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.multiple_states import friction_history_states, steady_states
from hbsolve.sensitivity import LevelParameter, sensitivity
from hbsolve.steady_state import steady_state
from reduction.jointed_system import CubicSpring, JenkinsElement, Joint, JointedSystem

ONE = np.ones(1)
DAMPING, CUBIC, FORCE = 0.05, 0.2, 0.3


def oscillator(*joints: Joint, force: float = FORCE, n_harmonic: int = 2) -> HarmonicBalance:
    system = JointedSystem(
        mass=[[1.0]], damping=[[DAMPING]], stiffness=[[1.0]], joints=joints, harmonic_force=[[0.0], [force]]
    )
    return HarmonicBalance(system=system, n_harmonic=n_harmonic)


def duffing() -> HarmonicBalance:
    return oscillator(CubicSpring(name="cubic", direction=ONE, stiffness=CUBIC))


def force_squared(omega: float) -> Polynomial:
    """F^2 over z = A^2 of the Duffing oscillator in one harmonic: ((1 - Omega^2 + 3/4 g z)^2 + (c Omega)^2) z."""
    z = Polynomial([0, 1])
    return ((1 - omega**2 + 0.75 * CUBIC * z) ** 2 + (DAMPING * omega) ** 2) * z


def amplitudes(omega: float) -> NDArray[np.float64]:
    """The positive roots, ascending."""
    roots = (force_squared(omega) - FORCE**2).roots()
    return np.sqrt(np.sort(roots[np.abs(roots.imag) < 1e-9].real))


@pytest.mark.parametrize(("omega", "count"), [(0.8, 1), (1.2, 1), (1.3, 3), (1.5, 3), (1.6, 3), (1.8, 1)])
def test_the_states_of_a_duffing_oscillator_are_the_roots_of_its_polynomial(omega: float, count: int) -> None:
    balance = duffing()
    states = steady_states(balance, omega)
    exact = amplitudes(omega)
    assert len(states) == len(exact) == count
    # |R| < 1e-9 of the linear motion, which near a resonance of the linear oscillator is some amplitudes large.
    np.testing.assert_allclose([state.amplitude(0) for state in states], exact, rtol=1e-7)
    assert all(state.residual_norm < 1e-9 for state in states)


@pytest.mark.parametrize("omega", [1.3, 1.5, 1.6])
def test_the_middle_one_falls_where_the_force_grows(omega: float) -> None:
    """Between two folds the amplitude falls with the force: the unstable state; dA/dlevel is that of the polynomial."""
    balance = duffing()
    slopes = []
    for state in steady_states(balance, omega):
        q, change = state.coefficients[1, 0], sensitivity(balance, state, [LevelParameter()])[0, 1, 0]
        slope = (np.conj(q) * change).real / abs(q)
        z = abs(q) ** 2
        # d(F^2) = 2 F^2 dlevel at level 1, dz = 2 A dA.
        exact = FORCE**2 / (force_squared(omega).deriv()(z) * abs(q))
        np.testing.assert_allclose(slope, exact, rtol=1e-5)  # amplitudes to 1e-7, enlarged by the closeness of folds
        slopes.append(slope)
    assert [bool(slope > 0) for slope in slopes] == [True, False, True]


def test_a_linear_oscillator_has_one_state() -> None:
    (state,) = steady_states(oscillator(), 1.2)
    np.testing.assert_allclose(state.amplitude(0), FORCE / abs(1 - 1.2**2 + 1.2j * DAMPING), rtol=1e-9)


def test_the_search_is_the_same_every_time() -> None:
    one, again = steady_states(duffing(), 1.6, seed=3), steady_states(duffing(), 1.6, seed=3)
    for state, other in zip(one, again, strict=True):
        np.testing.assert_array_equal(state.coefficients, other.coefficients)


KT, LIMIT, OMEGA = 0.5, 1.0, 0.9


def slider(force: float) -> HarmonicBalance:
    joint = JenkinsElement(name="slider", direction=ONE, tangential_stiffness=KT, limit_force=LIMIT)
    return oscillator(joint, force=force, n_harmonic=4)


def test_a_stuck_slider_has_one_state_for_each_history() -> None:
    """Its spring, of length w, pulls the mean to kt w / (k + kt); the vibration is that of the stuck oscillator."""
    balance = slider(force=0.05)
    assert len(friction_history_states(balance, 1, n_history=2)) == 2  # a whole number of rad/s is one as well
    states = friction_history_states(balance, OMEGA, n_history=8)
    assert len(states) == 8
    stuck = 0.05 / abs(1 + KT - OMEGA**2 + 1j * OMEGA * DAMPING)
    for state in states:
        w = float(state.periodic_slider[0])
        mean, vibration = state.coefficients[0, 0].real, state.amplitude(0)
        np.testing.assert_allclose(mean, KT * w / (1 + KT), atol=1e-9)  # residual, of a motion of 0.1
        np.testing.assert_allclose(vibration, stuck, rtol=1e-8)
        np.testing.assert_allclose(np.abs(state.coefficients[2:]).max(), 0.0, atol=1e-9)
        assert KT * (abs(mean - w) + vibration) < LIMIT  # it does stick
    means = sorted(state.coefficients[0, 0].real for state in states)
    assert np.diff(means).min() > 1e-3
    assert np.ptp(means) > 0.3  # a fair part of the continuum, +- limit / k less what vibrates
    assert any(state.periodic_slider[0] == 0 for state in states)  # springs without tension


def test_a_slider_that_slips_both_ways_forgets_its_history() -> None:
    (state,) = friction_history_states(slider(force=3.0), OMEGA, n_history=8)
    alone = steady_state(slider(force=3.0), OMEGA)
    np.testing.assert_allclose(state.coefficients, alone.coefficients, atol=1e-6)  # within `state.SAME_STATE`
    np.testing.assert_allclose(state.coefficients[0], 0.0, atol=1e-8)  # and its mean


def test_states_are_of_the_sliders_given() -> None:
    balance = slider(force=0.05)
    (state,) = steady_states(balance, OMEGA, slider=np.array([0.6]))
    np.testing.assert_allclose(state.coefficients[0, 0].real, KT * 0.6 / (1 + KT), atol=1e-9)
