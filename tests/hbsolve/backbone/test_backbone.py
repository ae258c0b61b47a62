"""Nonlinear modes against closed forms, against forced resonances, and against what a decay does in time."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipk

from hbsolve.backbone.backbone import Backbone, backbone
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.resonance import resonance_curve
from hbsolve.errors import BalanceError
from reduction.jointed_system import (
    BoucWenJoint,
    CubicSpring,
    FrictionContact,
    IwanJoint,
    JenkinsElement,
    Joint,
    JointedSystem,
    QuadraticDamper,
)
from tests.slow import slow

ONE = [1.0]


def oscillator(*joints: Joint, mass: float = 2.0, damping: float = 0.05, stiffness: float = 3.0) -> JointedSystem:
    return JointedSystem(
        mass=[[mass]], damping=[[damping]], stiffness=[[stiffness]], joints=list(joints), harmonic_force=[[0.0], [1.0]]
    )


def chain(*joints: Joint, damping: np.ndarray | None = None) -> JointedSystem:
    stiffness = np.array([[3.0, -1.0, 0.0], [-1.0, 2.4, -1.0], [0.0, -1.0, 2.0]])
    mass = np.diag([1.0, 1.3, 0.8])
    return JointedSystem(
        mass=mass, damping=0.004 * mass if damping is None else damping, stiffness=stiffness, joints=list(joints),
        harmonic_force=[[0, 0, 0], [0.0, 0.0, 0.02]],
    )  # fmt: skip


def at_amplitude(result: Backbone, amplitude: np.ndarray, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequency [rad/s] and damping ratio at amplitudes of a row [m]."""
    place = np.log(result.displacement(row))
    wanted = np.log(amplitude)
    return np.interp(wanted, place, result.angular_frequency), np.interp(wanted, place, result.damping_ratio)


def test_frequency_of_a_duffing_oscillator_is_that_of_the_elliptic_integral() -> None:
    """The period of m u'' + k u + c u^3 = 0 from u = X is 4 K(p) sqrt(m / (k + c X^2)), p = c X^2 / (2 (k + c X^2))."""
    result = backbone(
        HarmonicBalance(system=oscillator(CubicSpring(name="c", direction=ONE, stiffness=0.5)), n_harmonic=14),
        1, 0.05, 12.0,
    )  # fmt: skip
    assert result.complete
    top = np.abs(result.coefficients[:, :, 0].sum(axis=1))
    parameter = 0.5 * top**2 / (2 * (3 + 0.5 * top**2))
    expected = np.pi / 2 * np.sqrt((3 + 0.5 * top**2) / 2) / ellipk(parameter)
    # The damping, which is fed in again harmonic by harmonic, turns the motion by less than this.
    np.testing.assert_allclose(result.angular_frequency, expected, rtol=1e-5)
    np.testing.assert_allclose(result.damping_ratio, 0.05 / (2 * 2 * result.angular_frequency), rtol=1e-6)


def test_a_slider_has_the_describing_function_of_one_harmonic() -> None:
    """Masing: with H = 1, k(A) and the area of the loop are closed forms of theta, cos(theta) = 1 - 2 F / (k_t A)."""
    k_t, limit = 1.0, 0.3
    slider = JenkinsElement(name="j", direction=ONE, tangential_stiffness=k_t, limit_force=limit)
    result = backbone(HarmonicBalance(system=oscillator(slider), n_harmonic=2, n_sample=8192), 1, 0.05, 20.0)
    amplitude = result.displacement(0)
    slips = k_t * amplitude > 1.05 * limit
    theta = np.arccos(1 - 2 * limit / (k_t * amplitude[slips]))
    stiffness = k_t / np.pi * (theta - np.sin(2 * theta) / 2)
    area = 4 * limit * (amplitude[slips] - limit / k_t)
    omega = np.sqrt((3 + stiffness) / 2)
    zeta = (area / (np.pi * omega * amplitude[slips] ** 2) + 0.05) / (2 * 2 * omega)
    # Samples on either side of the turning points: second order in their distance.
    np.testing.assert_allclose(result.angular_frequency[slips], omega, rtol=1e-5)
    np.testing.assert_allclose(result.damping_ratio[slips], zeta, rtol=1e-4)
    stuck = k_t * amplitude < limit
    np.testing.assert_allclose(result.angular_frequency[stuck], np.sqrt(2.0), rtol=1e-8)


def test_smooth_hysteresis_has_the_describing_function_of_one_harmonic() -> None:
    """Bouc-Wen with n = 1, beta = 1/2: r = z / z_y grows as u / z_y below zero, and its rest 1 - r fades above."""
    k, limit = 1.0, 0.3
    joint = BoucWenJoint(name="j", direction=ONE, tangential_stiffness=k, limit_force=limit, exponent=1.0, shape=0.5)
    result = backbone(HarmonicBalance(system=oscillator(joint), n_harmonic=2, n_sample=8192), 1, 0.01, 5.0)
    place = result.displacement(0)
    for index in np.linspace(0, len(place) - 1, 9).astype(int):
        share = float(place[index]) * k / limit
        # Over a branch from r = -a to a the displacement changes by a z_y - ln(1 - a) z_y, twice the amplitude.
        a = brentq(lambda a, share=share: a - np.log(1 - a) - 2 * share, 0.0, 1 - 1e-15, xtol=1e-16)
        zero = a - share

        def force(x: float, zero: float = zero) -> float:
            return x - zero if x < zero else -np.expm1(zero - x)

        by_cosine = quad(
            lambda t, share=share: -2 / np.pi * np.cos(t) * force(-share * np.cos(t)), 0, np.pi,
            points=[np.arccos(-zero / share)], epsabs=1e-12,
        )[0]  # fmt: skip
        area = 2 * limit**2 / k * (-(a**2) / 2 - a - np.log(1 - a))
        omega = np.sqrt((3 + limit * by_cosine / place[index]) / 2)
        zeta = (area / (np.pi * omega * place[index] ** 2) + 0.05) / (2 * 2 * omega)
        # Corners of the loop between instants: second order in their distance.
        assert result.angular_frequency[index] == pytest.approx(omega, rel=1e-6)
        assert result.damping_ratio[index] == pytest.approx(zeta, rel=1e-5)


def test_dissipation_of_a_quadratic_damper_grows_with_the_amplitude() -> None:
    """Its work per period is 8/3 c omega^2 A^3."""
    damper = QuadraticDamper(name="q", direction=ONE, damping=0.2)
    result = backbone(HarmonicBalance(system=oscillator(damper, damping=0.0), n_harmonic=2, n_sample=4096), 1, 0.1, 2.0)
    omega, amplitude = result.angular_frequency, result.displacement(0)
    expected = 8 / 3 * 0.2 * omega**2 * amplitude**3 / (2 * np.pi * 2 * omega**2 * amplitude**2)
    np.testing.assert_allclose(result.damping_ratio, expected, rtol=1e-6)


def test_an_iwan_joint_dissipates_with_its_power() -> None:
    """Segalman: energy per period ~ A^(chi + 3), so that zeta ~ A^(chi + 1) where the loss is small."""
    joint = IwanJoint(name="i", direction=ONE, tangential_stiffness=1.0, limit_force=1.0, exponent=-0.4, ratio=0.5)
    result = backbone(HarmonicBalance(system=oscillator(joint, damping=0.0), n_harmonic=8), 1, 0.02, 0.3)
    slope = np.polyfit(np.log(result.amplitude), np.log(result.damping_ratio), 1)[0]
    assert slope == pytest.approx(0.6, abs=0.03)  # sliders are 32, and their steps show


@pytest.mark.parametrize(
    ("kind", "couples"),
    [
        pytest.param("cubic", False, marks=slow),
        ("contact", True),
        *(pytest.param(*case, marks=slow) for case in (("cubic", True), ("slider", False), ("slider", True))),
        pytest.param("contact", False, marks=slow),
    ],
)
def test_peaks_of_the_lightly_damped_system_lie_on_it(kind: str, couples: bool) -> None:
    """Peaks of forced responses, found from the derivative of the amplitude by other equations."""
    row = np.array([1.0, 0.0, 0.0])
    joint: Joint = {
        "cubic": CubicSpring(name="j", direction=row, stiffness=0.5),
        "slider": JenkinsElement(name="j", direction=row, tangential_stiffness=0.1, limit_force=0.05),
        "contact": FrictionContact(
            name="j", tangents=row, normal=np.array([0.0, 0.1, 0.0]), tangential_stiffness=0.1, normal_stiffness=0.2,
            friction_coefficient=0.5, preload=0.1,
        ),
    }[kind]  # fmt: skip
    damping = np.diag([0.004, 0.006, 0.002]) if couples else None
    balance = HarmonicBalance(system=chain(joint, damping=damping), n_harmonic=8, n_sample=1024)
    result = backbone(balance, 1, 0.01, 10.0, step=0.02)
    omega = float(result.angular_frequency[0])
    levels = [0.3, 0.6, 1.0]
    peaks = resonance_curve(balance, levels, 2, 0.9 * omega, 1.1 * omega)
    amplitude = np.array([peak.amplitude for peak in peaks])
    frequency, _ = at_amplitude(result, amplitude, 2)
    np.testing.assert_allclose([peak.state.angular_frequency for peak in peaks], frequency, rtol=1e-3)
    predicted = np.interp(np.log(amplitude), np.log(result.displacement(2)), result.level(balance.system.dynamic[1]))
    np.testing.assert_allclose(predicted, levels, rtol=0.02)  # one mode alone: the others answer by per cents


def test_second_mode_has_its_own_shape() -> None:
    spring = CubicSpring(name="c", direction=np.array([0.0, 1.0, 0.0]), stiffness=0.2)
    system = chain(spring)
    result = backbone(HarmonicBalance(system=system, n_harmonic=6), 2, 1e-3, 0.5)
    squared = np.linalg.eigvals(np.linalg.solve(system.mass, system.stiffness))
    assert result.angular_frequency[0] == pytest.approx(np.sqrt(np.sort(squared)[1]), rel=1e-5)
    assert result.modal_mass[0] == pytest.approx(result.amplitude[0] ** 2, rel=1e-4)


def test_bad_input_is_one_sentence() -> None:
    balance = HarmonicBalance(system=oscillator(), n_harmonic=3)
    with pytest.raises(BalanceError, match="there is no mode 2: the structure has 1 to 1"):
        backbone(balance, 2, 0.1, 1.0)
    with pytest.raises(BalanceError, match=r"from 1 to 0\.1 must be positive and ascending"):
        backbone(balance, 1, 1.0, 0.1)
    still = JointedSystem(mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], joints=[], harmonic_force=[[0.0]])
    mean = HarmonicBalance(system=still, n_harmonic=1)
    with pytest.raises(BalanceError, match="a mode needs its fundamental"):
        backbone(mean, 1, 0.1, 1.0)
    gyroscopic = chain(damping=np.array([[0.01, 0.1, 0], [-0.1, 0.01, 0], [0, 0, 0.01]]))
    turning = HarmonicBalance(system=gyroscopic, n_harmonic=3)
    with pytest.raises(BalanceError, match="the damping is not symmetric"):
        backbone(turning, 1, 0.1, 1.0)
    with pytest.raises(BalanceError, match="give 1 coefficients of harmonic 1"):
        backbone(balance, 1, 0.1, 1.0).level(np.ones(3))
