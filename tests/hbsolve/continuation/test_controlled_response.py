"""Force under response control against closed forms, and its states against the ordinary balance."""

from dataclasses import replace

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.continuation_parameter import equation
from hbsolve.continuation.controlled_amplitude import ControlledAmplitude
from hbsolve.continuation.controlled_response import controlled_response
from hbsolve.continuation.response import frequency_response
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import BalanceError
from hbsolve.solution import forces_at, residual
from hbsolve.state import make_initial_sliders
from hbsolve.steady_state import steady_state
from reduction.base_excitation import BaseExcitation, BaseMotion
from reduction.jointed_system import JenkinsElement, JointedSystem, along
from tests.hbsolve.continuation.test_response import chain, duffing, folds, left_over
from tests.slow import slow

ZETA = 5e-3
#: A row between two degrees of freedom.
ACROSS = along(5, {3: 0.8, 4: 0.6})


def duffing_level(omega: np.ndarray, a: float) -> np.ndarray:
    """|1 + 3/4 a^2 - Omega^2 + 2 i zeta Omega| a / 0.01: one harmonic of q'' + 2 zeta q' + q + q^3."""
    return np.hypot(1 + 0.75 * a**2 - omega**2, 2 * ZETA * omega) * a / 0.01


def friction_chain(damping: str) -> HarmonicBalance:
    """The chain of all laws, with a force in harmonic 1 alone, of a phase that is not zero."""
    system = chain(damping)
    force = np.zeros((2, 5), dtype=complex)
    force[1] = system.dynamic[1]
    return HarmonicBalance(system=replace(system, harmonic_force=force), n_harmonic=6)


# ---- closed forms


@pytest.mark.parametrize("amplitude", [0.05, 0.3, 0.6])
def test_the_level_is_that_of_the_duffing_oscillator_of_one_harmonic(amplitude: float) -> None:
    branch = controlled_response(duffing(zeta=ZETA, n_harmonic=2), 0, amplitude, 0.8, 2.0)
    assert branch.stop_reason is StopReason.REACHED
    # The motion of the spring is what is held: nothing is left to iterate, and nothing but round-off is wrong.
    np.testing.assert_allclose(branch.level, duffing_level(branch.angular_frequency, amplitude), rtol=1e-12)
    np.testing.assert_allclose(branch.amplitude(0), amplitude, rtol=1e-12)


def test_a_state_between_the_folds_lies_on_a_controlled_curve_that_does_not_turn() -> None:
    balance = duffing(zeta=ZETA)
    free = frequency_response(balance, 0.8, 2.0)
    up, down = folds(free.angular_frequency)
    middle = (up + down) // 2
    amplitude, omega = float(free.amplitude(0)[middle]), float(free.angular_frequency[middle])
    across = controlled_response(balance, 0, amplitude, 0.8, 2.0)
    assert across.stop_reason is StopReason.REACHED
    assert (np.diff(across.angular_frequency) > 0).all()
    there = controlled_response(balance, 0, amplitude, 0.8, omega)
    # Both are solved to 1e-9 of the linear motion, which is at most 1e3 times as far from the motion here.
    np.testing.assert_allclose(there.level[-1], 1.0, rtol=1e-6)
    np.testing.assert_allclose(there.coefficients[-1], free.coefficients[middle], atol=1e-6 * amplitude)


@pytest.mark.parametrize("amplitude", [0.5, 1.2, 3.0, 20.0])
def test_the_level_of_a_slider_has_its_secant_stiffness_and_its_loss(amplitude: float) -> None:
    kt, limit, c = 0.5, 0.5, 0.02
    system = JointedSystem(
        mass=[[1.0]],
        damping=[[c]],
        stiffness=[[1.0]],
        joints=[JenkinsElement(name="slider", direction=np.ones(1), tangential_stiffness=kt, limit_force=limit)],
        harmonic_force=[[0.0], [1j]],
    )
    balance = HarmonicBalance(system=system, n_harmonic=2, n_sample=4096)
    branch = controlled_response(balance, 0, amplitude, 0.5, 1.6)
    yield_ = limit / kt
    turned = np.arccos(1 - 2 * min(yield_ / amplitude, 1.0))  # angle over which it sticks after a reversal
    secant = kt / np.pi * (turned - np.sin(2 * turned) / 2)
    loss = 4 * limit * max(amplitude - yield_, 0.0) / (np.pi * amplitude**2)
    omega = branch.angular_frequency
    exact = amplitude * np.abs(1 + secant - omega**2 + 1j * (c * omega + loss))
    # A slip that begins between two samples is wrong by the square of their distance, 2 pi / 4096.
    np.testing.assert_allclose(branch.level, exact, rtol=3e-6)


def test_an_absolute_acceleration_on_a_shaken_base_needs_the_closed_form() -> None:
    k, c, held = 4.0, 0.1, 0.7
    base = BaseExcitation(base=BaseMotion.of(np.eye(1), np.ones(1)), amplitude=0.01, quantity="displacement")
    system = JointedSystem(mass=[[1.0]], damping=[[c]], stiffness=[[k]], harmonic_force=base.force)
    branch = controlled_response(
        HarmonicBalance(system=system, n_harmonic=2), 0, held, 1.0, 3.0, derivative=2, base=base
    )
    omega = branch.angular_frequency
    absolute = base.absolute(branch.coefficients, omega, branch.level)[:, 1, 0]
    np.testing.assert_allclose(omega**2 * np.abs(absolute), held, rtol=1e-12)  # linear: round-off
    transmitted = np.abs((k + 1j * c * omega) / (k - omega**2 + 1j * c * omega))
    # The level contains Omega^2 of the displacement, which the acceleration has as well.
    np.testing.assert_allclose(branch.level, held / (0.01 * transmitted), rtol=1e-12)


# ---- states of the ordinary balance


@pytest.mark.parametrize(
    ("damping", "derivative", "row"),
    [
        ("of the free structure", 0, 1),
        ("coupled", 2, ACROSS),
        *(pytest.param("modal", 1, row, marks=slow) for row in (1, ACROSS)),
        pytest.param("of the free structure", 0, ACROSS, marks=slow),
        pytest.param("coupled", 2, 1, marks=slow),
    ],
)
def test_states_under_control_are_states_of_the_balance_at_their_level(
    damping: str, derivative: int, row: int | np.ndarray
) -> None:
    balance = friction_chain(damping)
    held = 0.05 * 10.0**derivative
    branch = controlled_response(balance, row, held, 4.0, 16.0, step=1.0, derivative=derivative)
    assert branch.stop_reason is StopReason.REACHED
    assert branch.contact_share[:, :, 1].max() > 0.2  # slips
    np.testing.assert_allclose(branch.amplitude(row, derivative=derivative), held, rtol=2e-9)  # solved to 1e-9
    sliders = make_initial_sliders(balance, None)
    for point in range(0, len(branch.level), 4):
        omega, at_level = float(branch.angular_frequency[point]), balance.at_level(float(branch.level[point]))
        condensed, x = balance.at(omega), branch.start(balance, point)
        left = residual(at_level, condensed, x, forces_at(at_level, omega, x, sliders))
        # The tolerance of 1e-9, and that of the motion, which is recovered from the whole response.
        assert np.linalg.norm(left) < 1e-8 * np.linalg.norm(at_level.linear(condensed))
        state = steady_state(at_level, omega, start=x)
        assert state.iterations <= 1
        scale = np.abs(state.coefficients).max()
        np.testing.assert_allclose(branch.coefficients[point], state.coefficients, atol=1e-7 * scale)
        assert left_over(balance, state) < 1e-7  # |R| < 1e-9 of the motion, and stiff against soft contacts


def test_a_curve_back_is_the_curve_there() -> None:
    balance = friction_chain("coupled")
    there, back = (controlled_response(balance, 4, 0.05, *ends) for ends in ((4.0, 12.0), (12.0, 4.0)))
    np.testing.assert_allclose(back.level[[0, -1]], there.level[[-1, 0]], rtol=1e-7)  # 1e-9 of the stuck motion


@pytest.mark.parametrize("damping", ["of the free structure", "modal", "coupled"])
@pytest.mark.parametrize(("derivative", "on_base"), [(0, False), (2, True)])
def test_the_slope_along_frequency_equals_central_differences(damping: str, derivative: int, on_base: bool) -> None:
    balance = friction_chain(damping)
    base = BaseExcitation(base=BaseMotion.of(balance.system.mass, np.ones(5)), amplitude=0.5 - 0.3j)
    if on_base:
        balance = HarmonicBalance(system=replace(balance.system, harmonic_force=base.force), n_harmonic=6)
    path = ControlledAmplitude(
        balance=balance, row=2, amplitude=0.3, derivative=derivative, base=base if on_base else None
    )
    sliders = make_initial_sliders(balance, None)
    x = 1.1 * balance.linear(balance.at(7.0))
    here, below, above = (equation(path, value, x, sliders) for value in (7.0, 7.0 - 1e-5, 7.0 + 1e-5))
    difference = (above.residual - below.residual) / 2e-5
    assert np.abs(difference).max() > 0
    np.testing.assert_allclose(here.by_value, difference, atol=1e-6 * np.abs(difference).max())  # round-off over step


# ---- refusals


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"row": np.ones(3)}, r"\(3,\)"),
        ({"row": np.zeros(2)}, "zero"),
        ({"row": 2}, "0 to 1"),
        ({"amplitude": 0.0}, "amplitude = 0"),
        ({"amplitude": -1.0}, "amplitude = -1"),
        ({"amplitude": np.nan}, "nan"),
        ({"derivative": 3}, "derivative = 3"),
        ({"row": 1}, "does not move the sensor at 0.1"),
        ({"first": 2.0, "last": 2.0}, "empty"),
        ({"first": -1.0}, "positive"),
        ({"base": BaseExcitation(base=BaseMotion.of(np.eye(2), np.ones(2)), amplitude=1.0)}, "base"),
    ],
)
def test_what_cannot_be_held_is_refused(changes: dict[str, object], match: str) -> None:
    system = JointedSystem(
        mass=np.eye(2), damping=0.1 * np.eye(2), stiffness=np.diag([1.0, 2.0]), harmonic_force=[[0, 0], [1, 0]]
    )
    given = {"row": 0, "amplitude": 1.0, "first": 0.2 * np.pi, "last": 2.0} | changes
    with pytest.raises(BalanceError, match=match):
        controlled_response(HarmonicBalance(system=system, n_harmonic=2), **given)


@pytest.mark.parametrize(("force", "match"), [([[0], [1], [1]], "1, 2"), ([[0], [0], [1]], "2"), ([[0]], "nowhere")])
def test_a_force_in_other_harmonics_is_refused(force: list[list[float]], match: str) -> None:
    system = JointedSystem(mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], harmonic_force=force)
    with pytest.raises(BalanceError, match=match):
        controlled_response(HarmonicBalance(system=system, n_harmonic=3), 0, 1.0, 0.5, 2.0)
