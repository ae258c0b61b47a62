"""Verdicts on families: noise is no failure, a departure is told with its size, side and curve."""

import numpy as np
import pytest

from correlation.family.band import PredictedBand
from correlation.family.family import Family, FamilyCurve
from correlation.family.noise import ReadingNoise
from correlation.family.verdict import FamilyVerdict, judge_family

FREQUENCY = np.linspace(95.0, 105.0, 21)
LOWER, UPPER = 2.0 + 0.1 * (FREQUENCY - 100.0), 4.0 - 0.02 * (FREQUENCY - 100.0) ** 2
NOISE = ReadingNoise(relative=0.01, source="stated")


def band(**changes: np.ndarray) -> PredictedBand:
    values = {
        "frequency": FREQUENCY, "value": np.array([LOWER, UPPER]), "deviation": np.zeros((2, 21)),
        "jump": np.zeros((2, 21), dtype=bool),
    }  # fmt: skip
    return PredictedBand(**values | changes)


def family(*values: np.ndarray, frequency: np.ndarray = FREQUENCY) -> Family:
    curves = [
        FamilyCurve(test="t", repeat=number // 2 + 1, sweep=(1, -1)[number % 2], frequency=frequency, value=value)
        for number, value in enumerate(values)
    ]
    return Family(sensor="tip", harmonic=1, level=5.0, curves=tuple(curves))


def verdict(of: Family, over: PredictedBand | None = None, shift: float = 0.0) -> FamilyVerdict:
    return judge_family(of, over or band(), NOISE, shift=shift, n_reading=of.n_point)


def test_curves_inside_are_covered_and_the_tightness_is_width_over_spread() -> None:
    middle = (LOWER + UPPER) / 2
    quarter = (UPPER - LOWER) / 4
    result = verdict(family(middle - quarter, middle + quarter))
    assert result.coverage == 1.0
    assert not result.leaves_band
    assert result.departures == ()
    # Curves a half of the band apart.
    assert result.tightness == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_noise_about_a_closed_band_is_no_failure(seed: int) -> None:
    random = np.random.default_rng(seed)
    closed = band(value=np.array([UPPER, UPPER]))
    curves = [UPPER * (1 + 0.01 * random.standard_normal(21)) for _ in range(10)]
    result = verdict(family(*curves), closed)
    # One of 370 readings of noise is beyond three deviations.
    assert result.coverage > 0.97
    assert not result.leaves_band


def test_a_departure_has_its_side_size_and_curve() -> None:
    values = [(LOWER + UPPER) / 2 for _ in range(4)]
    values[3] = values[3].copy()
    values[3][5] = 0.7 * LOWER[5]
    result = verdict(family(*values))
    assert result.leaves_band
    (worst,) = result.departures
    assert (worst.side, worst.repeat, worst.sweep, worst.frequency) == ("lower", 2, -1, FREQUENCY[5])
    assert worst.limit == pytest.approx(LOWER[5])
    assert worst.distance == pytest.approx(0.3 * LOWER[5])
    # 30 % by a noise of 1 % of the limit.
    assert worst.deviations == pytest.approx(30.0, rel=1e-6)
    assert result.outside.sum() == 1


def test_an_error_of_the_frequency_widens_what_counts_as_outside() -> None:
    steep = 1 / np.hypot(1 - (FREQUENCY / 100) ** 2, 0.01)
    closed = band(value=np.array([steep, steep]))
    shifted = np.interp(FREQUENCY + 0.2, FREQUENCY, steep)
    assert verdict(family(shifted), closed).leaves_band
    assert not verdict(family(shifted), closed, shift=2e-3).leaves_band


def test_readings_beyond_the_band_and_without_a_limit_are_not_compared() -> None:
    value = np.array([LOWER, UPPER])
    value[1, 10] = np.nan
    wide = np.linspace(94.0, 106.0, 25)
    result = verdict(family(np.full(25, 3.0), frequency=wide), band(value=value))
    # Two readings at either end, one without its limit.
    assert result.n_compared == 25 - 2 * 2 - 1
    assert np.isnan(result.limit[:, 12]).all()


def test_half_way_to_an_end_without_a_limit_nothing_is_known() -> None:
    value = np.array([LOWER, UPPER])
    value[1, 0] = np.nan
    step = FREQUENCY[1] - FREQUENCY[0]
    upper = band(value=value).at(FREQUENCY[1] - step * np.array([0.0, 0.1, 0.6, 1.0])).value[1]
    np.testing.assert_array_equal(np.isfinite(upper), [True, True, False, False])


def test_between_two_frequencies_a_limit_is_smooth_and_next_to_a_jump_the_outer_one() -> None:
    between = (FREQUENCY[:-1] + FREQUENCY[1:]) / 2
    smooth = band().at(between)
    exact = 4.0 - 0.02 * (between - 100.0) ** 2
    # An Akima curve through a parabola, away from its ends.
    np.testing.assert_allclose(smooth.value[1, 2:-2], exact[2:-2], atol=1e-3)
    jump = np.zeros((2, 21), dtype=bool)
    jump[:, 10] = True
    open_ = band(jump=jump).at(between)
    assert open_.value[1, 9] == max(UPPER[9], UPPER[10])
    assert open_.value[0, 9] == min(LOWER[9], LOWER[10])
    np.testing.assert_array_equal(band(jump=jump).at(FREQUENCY).value, np.array([LOWER, UPPER]))


def test_limits_do_not_cross_beside_the_frequency_at_which_a_band_opens() -> None:
    """Static tangential limits of system 14852 of the benchmark of coverage: up to 56.2 Hz the contact slips."""
    frequency = np.array([54.82099, 55.15594, 55.4909, 56.16081, 56.49576, 56.83072, 57.16567])
    lower = np.array([-68.62631, -43.8314, 6.08963, 6.10762, -44.72404, -69.4711, -83.22846])
    upper = np.array([15.8801, 15.8801, 6.08963, 6.21515, 15.8801, 15.8801, 15.8801])
    none = np.zeros((2, 7))
    opening = PredictedBand(frequency=frequency, value=np.array([lower, upper]), deviation=none, jump=none.astype(bool))
    slipping = np.linspace(55.4909, 56.16081, 21)
    result = opening.at(slipping).value
    # Smooth curves through these would cross by 19 N.
    np.testing.assert_allclose(result[0], np.interp(slipping, frequency, lower), rtol=1e-12)
    np.testing.assert_allclose(result[1], np.interp(slipping, frequency, upper), rtol=1e-12)


def test_one_frequency_alone_is_a_band() -> None:
    one = PredictedBand(
        frequency=np.array([100.0]), value=np.array([[2.0], [3.0]]), deviation=np.zeros((2, 1)),
        jump=np.zeros((2, 1), dtype=bool),
    )  # fmt: skip
    at = one.at(np.array([100.0, 100.0004, 101.0]))
    np.testing.assert_array_equal(at.value, [[2.0, 2.0, np.nan], [3.0, 3.0, np.nan]])
