"""Peaks between the points of a branch, and against the level, in closed form."""

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.controlled_response import controlled_response
from hbsolve.continuation.resonance import resonance, resonance_curve
from hbsolve.continuation.response import frequency_response, level_response
from hbsolve.errors import BalanceError, NoPeakError
from hbsolve.steady_state import steady_state
from reduction.jointed_system import CubicSpring, ElasticStop, JenkinsElement, Joint, JointedSystem

ONE = np.ones(1)


def oscillator(*joints: Joint, damping: float, force: float = 1.0, n_harmonic: int = 2) -> HarmonicBalance:
    """q'' + damping q' + q + joints = force cos."""
    system = JointedSystem(
        mass=[[1.0]], damping=[[damping]], stiffness=[[1.0]], joints=joints, harmonic_force=[[0.0], [force]]
    )
    return HarmonicBalance(system=system, n_harmonic=n_harmonic)


def linear_peak(stiffness: float, damping: float) -> tuple[float, float]:
    """Omega and |q| / F where |q| is largest, of unit mass."""
    return np.sqrt(stiffness - damping**2 / 2), 1 / (damping * np.sqrt(stiffness - damping**2 / 4))


def duffing_peak(damping: float, cubic: float, force: float) -> tuple[float, float]:
    """Omega and A at the top of ((K - Omega^2)^2 + (c Omega)^2) A^2 = F^2 with K = 1 + 3/4 cubic A^2.

    dA/dOmega = 0 where Omega^2 = K - c^2 / 2; what is left is c^2 A^2 (K - c^2 / 4) = F^2, a quadratic in A^2.
    """
    a, b, c = 0.75 * cubic * damping**2, damping**2 * (1 - damping**2 / 4), -(force**2)
    squared = (-b + np.sqrt(b**2 - 4 * a * c)) / (2 * a)
    return np.sqrt(1 + 0.75 * cubic * squared - damping**2 / 2), np.sqrt(squared)


@pytest.mark.parametrize("damping", [0.004, 0.05, 0.6])
@pytest.mark.parametrize("joints", [(), (ElasticStop(name="far", direction=ONE, stiffness=5.0, gap=1e4),)])
def test_a_linear_peak_is_found_between_the_points(damping: float, joints: tuple[Joint, ...]) -> None:
    balance = oscillator(*joints, damping=damping)
    branch = frequency_response(balance, 0.5, 1.4, step=0.03)
    peak = resonance(balance, branch, 0)
    omega, amplitude = linear_peak(1.0, damping)
    # The frequency is solved to 1e-9; the residual of 1e-9, where the curve is flat, is the amplitude's own error.
    np.testing.assert_allclose(peak.state.angular_frequency, omega, rtol=3e-9)
    np.testing.assert_allclose(peak.amplitude, amplitude, rtol=3e-9)
    assert peak.frequency == peak.state.angular_frequency / (2 * np.pi)
    # None of the points is as high, nor as near.
    assert branch.amplitude(0).max() < peak.amplitude * (1 - 1e-7)
    assert np.abs(branch.angular_frequency - omega).min() > 1e-6


def test_the_output_may_be_a_row() -> None:
    system = JointedSystem(
        mass=np.eye(2),
        damping=0.02 * np.eye(2),
        stiffness=np.array([[2.0, -1.0], [-1.0, 2.0]]),
        harmonic_force=np.array([[0, 0], [1, 0]]),
    )
    balance = HarmonicBalance(system=system, n_harmonic=2)
    branch = frequency_response(balance, 0.7, 2.0)
    first, second = (resonance(balance, branch, np.array(row)) for row in ([0.5, 0.5], [0.5, -0.5]))
    # Sum and difference are the modes: Omega^2 = 1 and 3, each driven by half the force and seen alone.
    for peak, stiffness in ((first, 1.0), (second, 3.0)):
        omega, amplitude = linear_peak(stiffness, 0.02)
        np.testing.assert_allclose(peak.state.angular_frequency, omega, rtol=3e-9)
        np.testing.assert_allclose(peak.amplitude, amplitude / 2, rtol=3e-9)


@pytest.mark.parametrize("cubic", [0.2, -0.002])
def test_the_peaks_of_a_duffing_oscillator_follow_the_closed_form(cubic: float) -> None:
    damping, force, levels = 0.05, 0.1, [0.5, 1.0, 2.0, 4.0]
    balance = oscillator(
        CubicSpring(name="cubic", direction=ONE, stiffness=cubic), damping=damping, force=force, n_harmonic=2
    )
    done: list[tuple[float, float]] = []
    peaks = resonance_curve(balance, levels, 0, 0.8, 1.5, report=lambda at, of: done.append((at, of)))
    exact = np.array([duffing_peak(damping, cubic, level * force) for level in levels])
    # One harmonic alone is exactly the polynomial; the tolerance is that of the peak's frequency and of the residual,
    # which a peak that leans over enlarges.
    np.testing.assert_allclose([peak.state.angular_frequency for peak in peaks], exact[:, 0], rtol=1e-7)
    np.testing.assert_allclose([peak.amplitude for peak in peaks], exact[:, 1], rtol=1e-7)
    assert [peak.state.level for peak in peaks] == levels
    assert done == [(1, 4), (2, 4), (3, 4), (4, 4)]
    shift = exact[-1, 0] / exact[0, 0] - 1
    assert shift > 0.3 if cubic > 0 else shift < -0.01  # the windows had to follow


def test_a_first_range_beside_the_peak_is_widened() -> None:
    balance = oscillator(CubicSpring(name="cubic", direction=ONE, stiffness=0.2), damping=0.05, force=0.1)
    (peak,) = resonance_curve(balance, [1.0], 0, 0.7, 0.9)
    np.testing.assert_allclose(peak.state.angular_frequency, duffing_peak(0.05, 0.2, 0.1)[0], rtol=1e-7)


def test_a_sticking_slider_peaks_as_its_spring_and_a_free_one_as_none() -> None:
    """Between them friction makes the peak per force lower than both."""
    kt, damping = 0.5, 0.01
    slider = JenkinsElement(name="slider", direction=ONE, tangential_stiffness=kt, limit_force=1.0)
    balance = oscillator(slider, damping=damping, n_harmonic=4)
    levels = [1e-3, 1.0, 1e4]
    stuck, sliding, free = resonance_curve(balance, levels, 0, 1.0, 1.4)
    omega, amplitude = linear_peak(1 + kt, damping)
    np.testing.assert_allclose(stuck.state.angular_frequency, omega, rtol=3e-9)
    np.testing.assert_allclose(stuck.amplitude / levels[0], amplitude, rtol=3e-9)
    omega, amplitude = linear_peak(1.0, damping)
    # A slider of limit 1 takes 4 / pi of it from the force in phase with the velocity, and its spring's share is
    # smaller still: 1.3e-4 of 1e4.
    np.testing.assert_allclose(free.state.angular_frequency, omega, rtol=1e-4)
    np.testing.assert_allclose(free.amplitude, (levels[2] - 4 / np.pi) * amplitude, rtol=1e-5)
    assert sliding.amplitude / levels[1] < 0.5 * min(stuck.amplitude / levels[0], free.amplitude / levels[2])
    assert free.frequency < sliding.frequency < stuck.frequency


def test_no_neighbour_of_a_peak_is_higher() -> None:
    slider = JenkinsElement(name="slider", direction=ONE, tangential_stiffness=0.5, limit_force=1.0)
    balance = oscillator(slider, damping=0.01, n_harmonic=6)
    peak = resonance(balance, frequency_response(balance, 0.8, 1.4), 0)
    for share in (-1e-3, -1e-4, 1e-4, 1e-3):
        omega = peak.state.angular_frequency * (1 + share)
        assert steady_state(balance, omega, start=peak.state).amplitude(0) < peak.amplitude


@pytest.mark.parametrize(("first", "last", "end"), [(0.5, 0.9, "0.143239 Hz"), (1.1, 1.4, "0.17507 Hz")])
def test_a_branch_that_rises_to_its_end_has_no_peak(first: float, last: float, end: str) -> None:
    balance = oscillator(damping=0.01)
    with pytest.raises(NoPeakError, match=f"highest at {end}, an end of the branch: widen its range"):
        resonance(balance, frequency_response(balance, first, last), 0)


def test_a_response_without_a_peak_is_refused_after_widening() -> None:
    """Overdamped: the response falls from Omega = 0 on."""
    with pytest.raises(NoPeakError, match="an end of the branch"):
        resonance_curve(oscillator(damping=3.0), [1.0], 0, 0.5, 1.0)


def test_the_level_is_that_of_the_branch() -> None:
    """The branch leans to the peak of three times the force, whatever the level of the balance."""
    balance = oscillator(CubicSpring(name="cubic", direction=ONE, stiffness=0.2), damping=0.05, force=0.1)
    branch = frequency_response(balance.at_level(3.0), 0.8, 2.5)
    peak = resonance(balance, branch, 0)
    omega, amplitude = duffing_peak(0.05, 0.2, 0.3)
    # As above: the errors of frequency and residual, enlarged by the lean.
    np.testing.assert_allclose([peak.state.angular_frequency, peak.amplitude], [omega, amplitude], rtol=1e-7)
    assert peak.state.level == 3.0


@pytest.mark.parametrize("power", [1, 2])
def test_the_level_may_follow_a_power_of_the_frequency(power: int) -> None:
    """|q| = Omega^p / |1 - Omega^2 + i c Omega| is highest where p / Omega is the slope of log |1 - ...|."""
    damping = 0.3
    branch = frequency_response(oscillator(damping=damping), 0.5, 2.0, step=0.05, level_power=power)
    # The level of the balance has no bearing.
    peak = resonance(oscillator(damping=damping).at_level(7.0), branch, 0)
    squared = 1.0 if power == 1 else 1 / (1 - damping**2 / 2)
    height = squared ** (power / 2) / np.sqrt((1 - squared) ** 2 + damping**2 * squared)
    # Frequency to 1e-9, and the residual.
    np.testing.assert_allclose([peak.state.angular_frequency, peak.amplitude], [np.sqrt(squared), height], rtol=3e-9)
    np.testing.assert_allclose(peak.state.level, peak.state.angular_frequency**power, rtol=1e-12)


def test_a_slider_on_a_shaken_base_peaks_higher_than_its_neighbours() -> None:
    """The slope at a level that follows Omega^2 is exact with friction as well."""
    slider = JenkinsElement(name="slider", direction=ONE, tangential_stiffness=0.5, limit_force=1.0)
    balance = oscillator(slider, damping=0.01, n_harmonic=6)
    peak = resonance(balance, frequency_response(balance, 0.8, 1.4, level_power=2), 0)
    # 0.3 % away the amplitude is 0.3 % lower; nearer, each sample that begins to slip makes a kink of 0.01 %.
    for share in (-3e-3, 3e-3):
        omega = peak.state.angular_frequency * (1 + share)
        assert steady_state(balance.at_level(omega**2), omega, start=peak.state).amplitude(0) < peak.amplitude


def test_only_a_branch_over_frequency_has_a_resonance() -> None:
    balance = oscillator(CubicSpring(name="cubic", direction=ONE, stiffness=0.2), damping=0.05, force=0.1)
    with pytest.raises(BalanceError, match="the frequency does not change along the branch"):
        resonance(balance, level_response(balance, 1.0, 0.5, 1.0), 0)
    controlled = controlled_response(balance, 0, 0.5, 0.8, 1.5)
    with pytest.raises(BalanceError, match="both frequency and level change"):
        resonance(balance, controlled, 0)
