"""What the metrics say of responses in closed form."""

import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.metric import (
    amplitude_error,
    damping_error,
    frequency_error,
    harmonic_ratio,
    inverse_frf,
    inverse_frf_deviation,
    inverse_frf_error,
    phase_error,
    resonance,
)

ROUND_OFF = 1e-9  # relative; peaks are some hundred times their surroundings


def response(frequency: np.ndarray, f0: float = 100.0, zeta: float = 0.01, mass: float = 0.5) -> np.ndarray:
    w, w0 = 2 * np.pi * frequency, 2 * np.pi * f0
    return 1 / (mass * (w0**2 - w**2 + 2j * zeta * w0 * w))


def test_a_scaled_and_turned_response_is_off_by_just_that() -> None:
    measured = response(np.linspace(90, 110, 21))
    predicted = 1.2 * np.exp(0.3j) * measured
    assert amplitude_error(measured, predicted) == pytest.approx(0.2, rel=ROUND_OFF)
    assert phase_error(measured, predicted) == pytest.approx(0.3, rel=ROUND_OFF)
    assert phase_error(predicted, measured) == pytest.approx(-0.3, rel=ROUND_OFF)


def test_the_inverse_frf_tells_the_missing_spring_mass_and_damper() -> None:
    frequency = np.linspace(90, 110, 21)
    omega = 2 * np.pi * frequency
    spring, mass, dashpot = 2e3, 0.003, 0.4
    predicted = response(frequency)
    measured = 1 / (1 / predicted + spring - omega**2 * mass + 1j * omega * dashpot)
    missing = inverse_frf_error(3 * measured, 3 * predicted, 3.0)
    np.testing.assert_allclose(missing.real, spring - omega**2 * mass, rtol=1e-8)  # a difference of some 1 % of both
    np.testing.assert_allclose(missing.imag, omega * dashpot, rtol=1e-8)


def test_the_deviation_of_the_inverse_frf_is_that_of_a_sample() -> None:
    rng = np.random.default_rng(1)
    noise = 1e-3 * rng.normal(size=(2, 100_000))
    sample = inverse_frf(0.4 - 0.7j + noise[0] + 1j * noise[1], 5.0)
    expected = inverse_frf_deviation(np.array(0.4 - 0.7j), np.array(1e-3), 5.0)
    # The deviation of a sample of 1e5 has a deviation of 0.2 %.
    assert sample.real.std() == pytest.approx(float(expected), rel=0.01)
    assert sample.imag.std() == pytest.approx(float(expected), rel=0.01)


def test_a_harmonic_ratio_does_not_depend_on_the_origin_of_time() -> None:
    first, third, shift = 2.0 * np.exp(0.4j), 0.1 * np.exp(-1.1j), 0.83
    ratio = harmonic_ratio(np.array(third), np.array(first), 3)
    shifted = harmonic_ratio(np.array(third * np.exp(3j * shift)), np.array(first * np.exp(1j * shift)), 3)
    assert abs(ratio) == pytest.approx(0.05)
    assert shifted == pytest.approx(complex(ratio), rel=ROUND_OFF)


@pytest.mark.parametrize("zeta", [0.001, 0.01, 0.1])
def test_frequency_and_damping_of_one_degree_of_freedom_are_exact(zeta: float) -> None:
    frequency = 100 * (1 + zeta * np.linspace(-4, 4, 25))
    f0, damping = resonance(frequency, response(frequency, 100.0, zeta) * np.exp(0.7j))
    assert f0 == pytest.approx(100.0, rel=ROUND_OFF)
    assert damping == pytest.approx(zeta, rel=1e-6)  # a difference of squares, at most 1e6 times round-off


def test_the_order_of_frequencies_does_not_matter() -> None:
    frequency = np.linspace(95, 105, 30)
    assert resonance(frequency, response(frequency)) == pytest.approx(
        resonance(frequency[::-1], response(frequency)[::-1]), rel=ROUND_OFF
    )


def test_a_resonance_between_three_points_is_found_in_noise() -> None:
    frequency = np.linspace(97, 103, 24)
    rng = np.random.default_rng(2)
    noise = 1 + 0.005 * rng.normal(size=(2, 200, 24))
    found = np.array([resonance(frequency, response(frequency) * n) for n in noise[0] * np.exp(1j * (noise[1] - 1))])
    # Half a per cent of noise on some eight points of a peak 2 Hz wide: about 0.005 Hz, and 1 % of the damping.
    assert found[:, 0] == pytest.approx(100.0, rel=3e-4)
    assert found[:, 1] == pytest.approx(0.01, rel=0.05)


def test_errors_of_frequency_and_damping_are_relative() -> None:
    frequency = np.linspace(95, 106, 60)
    measured, predicted = response(frequency, 100.0, 0.01), response(frequency, 101.0, 0.012)
    assert frequency_error(frequency, measured, predicted) == pytest.approx(0.01, rel=1e-6)
    assert damping_error(frequency, measured, predicted) == pytest.approx(0.2, rel=1e-6)


def test_a_peak_at_the_end_of_the_band_is_refused() -> None:
    frequency = np.linspace(90, 99, 10)
    with pytest.raises(CampaignError, match="no resonance between 90 and 99 Hz: the response is largest at an end"):
        resonance(frequency, response(frequency))
