"""Phases that one angle turns are told from those of a resonance that is off."""

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.data_quality.phase_offset import find_phase_offset


def response(frequency: NDArray[np.float64], f0: float = 100.0, zeta: float = 0.01) -> NDArray[np.complex128]:
    """Of one mode."""
    return np.asarray(1 / (f0**2 - frequency**2 + 2j * zeta * f0 * frequency))


@pytest.mark.parametrize("half_widths", [3.0, 20.0])
@pytest.mark.parametrize("angle", [-170.0, -30.0, 10.0, 60.0])
def test_an_angle_is_found_over_the_resonance_and_over_a_band_far_wider(half_widths: float, angle: float) -> None:
    frequency = 100.0 + half_widths * np.linspace(-1, 1, 41)
    noise = 0.003 * np.random.default_rng(1).standard_normal((2, 41))
    value = response(frequency, 100.01) * np.exp(1j * np.radians(angle)) * (1 + noise[0] + 1j * noise[1])
    result = find_phase_offset(value, response(frequency), frequency, np.zeros(41, dtype=int))
    assert result is not None
    assert np.degrees(result.angle) == pytest.approx(angle, abs=1.0)
    assert result.agreement == pytest.approx(np.cos(np.radians(angle)), abs=0.02)


@pytest.mark.parametrize("half_widths", [0.3, 1.0, 3.0, 20.0])
@pytest.mark.parametrize(("f0", "zeta"), [(100.0, 0.01), (100.3, 0.01), (101.0, 0.012), (98.0, 0.01), (100.0, 0.02)])
def test_a_resonance_that_is_off_turns_no_phases_by_one_angle(half_widths: float, f0: float, zeta: float) -> None:
    frequency = 100.0 + half_widths * np.linspace(-1, 1, 41)
    value = response(frequency, f0, zeta)
    assert find_phase_offset(value, response(frequency), frequency, np.zeros(41, dtype=int)) is None


def test_two_points_of_a_curve_tell_no_slope() -> None:
    frequency = np.array([95.0, 105.0])
    assert find_phase_offset(1j * response(frequency), response(frequency), frequency, np.zeros(2, dtype=int)) is None
