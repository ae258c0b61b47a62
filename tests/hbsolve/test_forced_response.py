"""Forced response against closed forms."""

import numpy as np
import pytest

from hbsolve.continuation.stop_reason import StopReason
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.errors import ForceError
from hbsolve.forced_response import HarmonicForce, forced_response
from hbsolve.fourier import samples_from_coefficients

ROUND_OFF = 1e-10


def chain(n: int = 4) -> DynamicStiffness:
    stiffness = 100 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    return DynamicStiffness(mass=np.eye(n), damping=0.01 * stiffness + 0.1 * np.eye(n), stiffness=stiffness)


def force_on(n: int, *, static: float = 0.0, n_harmonic: int = 3) -> HarmonicForce:
    coefficients = np.zeros((n_harmonic, n), dtype=complex)
    coefficients[0, 0] = static
    coefficients[1, -1] = 2.0 - 1.0j
    coefficients[n_harmonic - 1, 1] += 0.5j
    return HarmonicForce(coefficients=coefficients)


def bar_tip_error(n_element: int, omega: np.ndarray, beta: float) -> np.ndarray:
    """Relative error at the tip of a clamped bar of linear elements: E A = rho A = length = 1."""
    h, n = 1 / n_element, n_element
    two = np.r_[2 * np.ones(n - 1), 1]
    off = np.eye(n, k=1) + np.eye(n, k=-1)
    stiffness = (np.diag(two) - off) / h
    mass = (np.diag(2 * two) + off) * h / 6
    model = DynamicStiffness(mass=mass, damping=beta * stiffness, stiffness=stiffness)
    coefficients = np.zeros((2, n), dtype=complex)
    coefficients[1, -1] = 1.0
    tip = forced_response(model, HarmonicForce(coefficients=coefficients), omega).coefficients[:, 1, -1]
    modulus = 1 + 1j * omega * beta  # damping proportional to stiffness is a complex modulus
    wave_number = omega / np.sqrt(modulus)
    exact = np.tan(wave_number) / (modulus * wave_number)
    return np.abs(tip / exact - 1)


def test_a_bar_converges_to_its_closed_form_with_order_two() -> None:
    omega = np.array([0.3, 1.2, 1.55, 3.0, 4.6])  # below, near and above the first two resonances
    coarse, fine = bar_tip_error(40, omega, 0.02), bar_tip_error(80, omega, 0.02)
    np.testing.assert_allclose(np.log2(coarse / fine), 2, atol=0.02)  # next term is order 4: 1e-3
    assert np.all(fine < 5e-3)


def test_each_harmonic_answers_its_own_force() -> None:
    model, force = chain(), force_on(4, static=3.0)
    omega = np.array([2.0, 9.0])
    branch = forced_response(model, force, omega)
    for p, item in enumerate(omega):
        for k in range(3):
            w = k * item
            expected = np.linalg.solve(
                model.stiffness - w**2 * model.mass + 1j * w * model.damping, force.coefficients[k]
            )
            np.testing.assert_allclose(branch.coefficients[p, k], expected, rtol=1e-9, atol=1e-14)
    assert np.all(branch.residual_norm < ROUND_OFF)
    assert branch.stop_reason is StopReason.SOLVED
    np.testing.assert_allclose(branch.amplitude(3), np.abs(branch.coefficients[:, 1, 3]))
    np.testing.assert_allclose(branch.frequency, omega / (2 * np.pi))


def test_the_motion_satisfies_the_equation_of_motion_in_time() -> None:
    model, force = chain(), force_on(4, static=3.0)
    q = forced_response(model, force, np.array([7.0])).coefficients[0]
    ik = 1j * 7.0 * np.arange(3)[:, None]
    displacement, velocity, acceleration, load = (
        samples_from_coefficients(x, 9) for x in (q, ik * q, ik**2 * q, force.coefficients)
    )
    held = acceleration @ model.mass + velocity @ model.damping + displacement @ model.stiffness
    np.testing.assert_allclose(held, load, atol=ROUND_OFF)


def test_no_force_no_motion() -> None:
    branch = forced_response(chain(), HarmonicForce(coefficients=np.zeros((2, 4))), np.array([1.0]))
    np.testing.assert_array_equal(branch.coefficients, 0)
    np.testing.assert_array_equal(branch.residual_norm, 0)


def test_wrong_forces_are_refused() -> None:
    with pytest.raises(ForceError, match=r"force holds \(nan\+0j\) at \(1, 2\): give finite numbers"):
        HarmonicForce(coefficients=np.array([[0, 0, 0], [0, 0, np.nan]]))
    with pytest.raises(ForceError, match=r"static force on row 1 is 0\+2j N: harmonic 0 is a mean and must be real"):
        HarmonicForce(coefficients=np.array([[0, 2j]]))
    with pytest.raises(ForceError, match=r"shape \(3,\)"):
        HarmonicForce(coefficients=np.zeros(3))
    with pytest.raises(ForceError, match="force acts on 5 degrees of freedom, the model has 4"):
        forced_response(chain(), force_on(5), np.array([1.0]))
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(ForceError, match=f"angular_frequency = {wrong:g} rad/s must be positive"):
            forced_response(chain(), force_on(4), np.array([1.0, wrong]))
