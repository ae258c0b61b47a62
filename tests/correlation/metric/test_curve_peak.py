"""Peaks of a response: where it stands out of its valleys and of the noise, in each measured band."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.feature.gap import find_gaps
from correlation.metric.curve_peak import find_curve_peaks

GRID = np.linspace(20.0, 80.0, 241)


def modes(frequency: NDArray[np.float64], *resonances: float, damping: float = 0.01) -> NDArray[np.complex128]:
    """Modes of one sensor, all as high, shape (1, f)."""
    item = [r**2 / (r**2 - frequency**2 + 2j * damping * r * frequency) for r in resonances]
    return np.sum(item, axis=0)[None]


@pytest.mark.parametrize("resonances", [(40.0,), (30.0, 70.0), (30.0, 33.0, 70.0)])
def test_every_mode_makes_a_peak_between_its_valleys(resonances: tuple[float, ...]) -> None:
    result = find_curve_peaks(GRID, modes(GRID, *resonances))
    # Half a step of the frequencies.
    assert [peak.frequency for peak in result] == pytest.approx(resonances, abs=0.13)
    assert result[0].low == GRID[0]
    assert result[-1].high == GRID[-1]
    for one, other in pairwise(result):
        assert one.frequency < one.high == other.low < other.frequency


def test_modes_that_the_response_does_not_fall_between_are_one_peak() -> None:
    assert len(find_curve_peaks(GRID, modes(GRID, 30.0, 30.3, damping=0.02))) == 1


def test_noise_on_a_flank_is_no_peak() -> None:
    random = np.random.default_rng(3)
    # An antiresonance at 60 Hz, where noise alone is left.
    exact, deviation = modes(GRID, 40.0) * (GRID - 60.0) / 20, 0.02
    noisy = exact + deviation * (random.standard_normal(exact.shape) + 1j * random.standard_normal(exact.shape))
    assert len(find_curve_peaks(GRID, noisy)) > 1
    (result,) = find_curve_peaks(GRID, noisy, np.full(exact.shape, deviation))
    assert result.frequency == pytest.approx(40.0, abs=0.13)


def test_a_band_that_begins_above_a_resonance_has_no_peak_although_another_band_ends_lower() -> None:
    apart = np.concatenate([np.linspace(28, 32, 17), np.linspace(70.5, 75, 19)])
    (result,) = find_curve_peaks(apart, modes(apart, 30.0, 70.0))
    assert result.frequency == pytest.approx(30.0, abs=0.13)
    assert result.high == 32.0


def test_readings_in_pairs_of_both_sweeps_are_one_band() -> None:
    pairs = np.sort(np.concatenate([GRID, GRID + 1e-3]))
    (result,) = find_curve_peaks(pairs, modes(pairs, 40.0))
    assert result.frequency == pytest.approx(40.0, abs=0.13)
    assert (result.low, result.high) == (pairs[0], pairs[-1])


def test_a_gap_is_a_step_unlike_those_on_either_side() -> None:
    refined = np.concatenate([np.arange(20, 28, 1.0), np.arange(28, 32, 0.05), np.arange(32, 40, 1.0)])
    assert not len(find_gaps(refined))
    assert not len(find_gaps(np.array([1.0, 100.0])))
    bands = np.concatenate([np.arange(20, 28, 0.5), np.arange(60, 70, 0.7), np.arange(100, 110, 1.0)])
    np.testing.assert_array_equal(np.diff(bands)[find_gaps(bands)] > 30, [True, True])
