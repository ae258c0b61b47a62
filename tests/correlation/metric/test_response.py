"""What the metrics say of responses in closed form."""

import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.metric.response import amplitude_error, find_peak, fit_resonance, phase_error

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


@pytest.mark.parametrize("zeta", [0.001, 0.01, 0.1])
def test_frequency_and_damping_of_one_degree_of_freedom_are_exact(zeta: float) -> None:
    frequency = 100 * (1 + zeta * np.linspace(-4, 4, 25))
    f0, damping = fit_resonance(frequency, response(frequency, 100.0, zeta) * np.exp(0.7j))
    assert f0 == pytest.approx(100.0, rel=ROUND_OFF)
    assert damping == pytest.approx(zeta, rel=1e-6)  # a difference of squares, at most 1e6 times round-off


def test_the_order_of_frequencies_does_not_matter() -> None:
    frequency = np.linspace(95, 105, 30)
    assert fit_resonance(frequency, response(frequency)) == pytest.approx(
        fit_resonance(frequency[::-1], response(frequency)[::-1]), rel=ROUND_OFF
    )


def test_a_resonance_between_three_points_is_found_in_noise() -> None:
    frequency = np.linspace(97, 103, 24)
    rng = np.random.default_rng(2)
    noise = 1 + 0.005 * rng.normal(size=(2, 200, 24))
    result = np.array(
        [fit_resonance(frequency, response(frequency) * n) for n in noise[0] * np.exp(1j * (noise[1] - 1))]
    )
    # Half a per cent of noise on some eight points of a peak 2 Hz wide: about 0.005 Hz, and 1 % of the damping.
    assert result[:, 0] == pytest.approx(100.0, rel=3e-4)
    assert result[:, 1] == pytest.approx(0.01, rel=0.05)


def test_a_peak_at_the_end_of_the_band_is_refused() -> None:
    frequency = np.linspace(90, 99, 10)
    with pytest.raises(CampaignError, match="no resonance between 90 and 99 Hz: the response is largest at an end"):
        fit_resonance(frequency, response(frequency))


def test_three_points_are_a_peak_if_the_middle_one_is_the_highest() -> None:
    assert find_peak(np.array([1.0, 2.0, 3.0]), np.array([1, 2j, 1])).tolist() == [True, True, True]
    with pytest.raises(CampaignError, match="no resonance"):
        find_peak(np.array([1.0, 2.0]), np.array([1, 2j]))
