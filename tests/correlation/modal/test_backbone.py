"""Frequency and damping against level, for resonances whose amplitude dependence is prescribed."""

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.modal.backbone import fit_peak

FREQUENCY = np.linspace(95, 105, 81)
LEVELS = np.array([1.0, 3.0, 5.0, 10.0])
OWN, DAMPING = 100 - 0.1 * LEVELS, 0.004 + 0.0004 * LEVELS


def curves(power: int) -> list[NDArray[np.complex128]]:
    omega = 2 * np.pi * FREQUENCY
    return [
        level * (1j * omega) ** power / ((2 * np.pi * own) ** 2 - omega**2 + 2j * damping * 2 * np.pi * own * omega)
        for level, own, damping in zip(LEVELS, OWN, DAMPING, strict=True)
    ]


@pytest.mark.parametrize(("quantity", "power"), [("displacement", 0), ("velocity", 1), ("acceleration", 2)])
@pytest.mark.parametrize("has_phase", [True, False])
def test_a_single_mode_per_level_is_exact(quantity: str, power: int, has_phase: bool) -> None:
    responses = [curve if has_phase else np.abs(curve) for curve in curves(power)]
    result = np.array([fit_peak(FREQUENCY, response, None, quantity) for response in responses])
    # The parabola of 1 / |X|^2 is exact for one mode.
    np.testing.assert_allclose(result[:, 2], OWN, rtol=1e-9)
    np.testing.assert_allclose(result[:, 4], DAMPING, rtol=1e-6)
    at_peak = LEVELS * (2 * np.pi * OWN) ** (power - 2) / (2 * DAMPING)
    np.testing.assert_allclose(result[:, 0], at_peak, rtol=1e-6)


def test_deviations_are_the_scatter_of_repeats() -> None:
    random = np.random.default_rng(0)
    scores = []
    for _ in range(60):
        for curve, own, damping in zip(curves(0), OWN, DAMPING, strict=True):
            size = 0.01 * np.abs(curve).max() / np.sqrt(2)
            noisy = curve + size * (random.standard_normal(81) + 1j * random.standard_normal(81))
            result = fit_peak(FREQUENCY, noisy, np.full(81, size), "displacement")
            scores.append([(result[2] - own) / result[3], (result[4] - damping) / result[5]])
    # The scatter that the fit leaves is estimated from few points, and the larger of it and the stated one counts:
    # deviations are too large rather than too small.
    assert 0.4 < np.mean(np.square(scores)) < 1.4


def test_a_curve_without_a_peak_is_refused() -> None:
    with pytest.raises(CampaignError):
        fit_peak(FREQUENCY, np.linspace(1, 2, 81), None, "displacement")


def test_three_points_of_a_peak_of_two_modes_are_as_uncertain_as_they_are_wrong() -> None:
    lines = np.linspace(80, 120, 11)  # 4 Hz apart, three of them within the peak
    omega = 2 * np.pi * lines
    errors = []
    for share in (0.0, 0.005, 0.02, 0.05):  # the second mode adds a share of the first one's height
        one, other = (
            size / ((2 * np.pi * own) ** 2 - omega**2 + 2j * 0.01 * 2 * np.pi * own * omega)
            for own, size in ((100.7, 1.0), (140.0, 60.0 * share))
        )
        result = fit_peak(lines, one + other, None, "displacement")
        errors.append((abs(result[2] - 100.7), result[3]))
    assert errors[0][1] < 1e-9  # one mode leaves nothing
    assert all(error < 3 * deviation for error, deviation in errors[1:])


def test_three_points_in_all_have_no_deviation() -> None:
    chosen = np.array([30, 36, 44])
    result = fit_peak(FREQUENCY[chosen], curves(0)[0][chosen], None, "displacement")
    assert result[2] == pytest.approx(OWN[0], rel=1e-9)  # a parabola through three points is exact
    assert np.isnan(result[3])
