"""Noise from the roughness of few curves: its mean is that of the readings, and it scatters as its freedom says."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.family.band import PredictedBand
from correlation.family.family import Family, FamilyCurve, number_points
from correlation.family.noise import MOST_GAIN, ReadingNoise, estimate_repeat_errors
from correlation.family.verdict import judge_family
from correlation.noise.variance import compute_margin
from tests.correlation.family.test_family import campaign

FREQUENCY = np.linspace(97.0, 103.0, 6)
RESONANCE = 1 / np.hypot(1 - (FREQUENCY / 100.0) ** 2, 0.02)
N_CURVE, NOISE, LEVELS = 4, 0.01, (0.3, 1.0, 3.0)


def eight_curves(random: np.random.Generator, noise: float) -> list[Family]:
    """Three levels of a resonance, four repeats up and down of each."""
    return [
        replace(item, curves=tuple(
            replace(
                item.curves[number % 2], repeat=number // 2,
                value=item.level * RESONANCE * (1 + noise * random.standard_normal(len(FREQUENCY))),
            )
            for number in range(8)
        ))
        for item in families(random)
    ]  # fmt: skip


def families(random: np.random.Generator) -> list[Family]:
    """Three levels of a resonance without friction, four curves of each."""
    return [
        Family(
            sensor="tip", harmonic=1, level=level,
            curves=tuple(
                FamilyCurve(
                    test="t", repeat=number // 2, sweep=(1, -1)[number % 2], frequency=FREQUENCY,
                    value=level * RESONANCE * (1 + NOISE * random.standard_normal(len(FREQUENCY))),
                )
                for number in range(N_CURVE)
            ),
        )
        for level in LEVELS
    ]  # fmt: skip


@pytest.fixture(scope="module")
def estimates() -> list[tuple[list[Family], ReadingNoise]]:
    """Families of 100 campaigns, and the noise that each of them tells."""
    measured = [families(np.random.default_rng(seed)) for seed in range(100)]
    return [(item, estimate_repeat_errors(campaign(), item).noise["tip", 1]) for item in measured]


def test_the_fitted_frequency_takes_no_noise_away(estimates: list[tuple[list[Family], ReadingNoise]]) -> None:
    largest = LEVELS[-1] * RESONANCE
    ratio = np.array([(item.deviation(largest) / (NOISE * largest)) ** 2 for _, item in estimates])
    # The standard error of the mean is 0.035. The absolute part, which is never negative, takes 0.09 of the variance
    # where there is none; a fit without account of the frequency has 0.80.
    assert 0.85 < ratio.mean() < 1.05
    # Robust fits scatter as if they had somewhat fewer degrees of freedom, or more where the absolute part is at 0.
    freedom = np.mean([item.freedom(largest) for _, item in estimates])
    assert 0.5 * freedom < 2 / ratio.var(axis=0).mean() < 2 * freedom


def test_noise_that_was_estimated_is_no_failure(estimates: list[tuple[list[Family], ReadingNoise]]) -> None:
    leaves = 0
    for measured, noise in estimates:
        count = sum(item.n_point for item in measured)
        for item in measured:
            closed = PredictedBand(
                frequency=FREQUENCY, value=np.tile(item.level * RESONANCE, (2, 1)), deviation=np.zeros((2, 6)),
                jump=np.zeros((2, 6), dtype=bool),
            )  # fmt: skip
            leaves += judge_family(item, closed, noise, shift=0.0, n_reading=count).leaves_band
    # A reading and the number of readings each have a chance of one in a hundred campaigns: a mean of 2, and no more
    # than 6 in 99 of a hundred cases.
    assert leaves <= 6


def test_noise_that_few_readings_of_another_level_tell_claims_no_failure() -> None:
    leaves = 0
    for seed in range(50):
        random = np.random.default_rng(seed)
        # Four frequencies at the lowest level, which give two roughnesses, and two at the highest, which give none.
        few = [
            replace(item, curves=tuple(
                curve.where(slice(-count, None)) for curve in item.curves
            ))
            for item, count in zip(families(random)[::2], (4, 2), strict=True)
        ]  # fmt: skip
        noise = estimate_repeat_errors(campaign(), few).noise["tip", 1]
        assert noise.source == "curves"
        own, other = (item.level * RESONANCE[-1:] for item in few)
        assert 1 <= noise.freedom(other)[0] <= noise.freedom(own)[0] < 10
        count = sum(item.n_point for item in few)
        for item in few:
            closed = PredictedBand(
                frequency=FREQUENCY, value=np.tile(item.level * RESONANCE, (2, 1)),
                deviation=np.tile(0.1 * NOISE * item.level * RESONANCE, (2, 1)), jump=np.zeros((2, 6), dtype=bool),
            )  # fmt: skip
            # A small error that is known makes a noise that is not no more certain.
            leaves += judge_family(item, closed, noise, shift=0.0, n_reading=count).leaves_band
    # One in a hundred by each of two criteria: a mean of 1, and no more than 4 in 99 of a hundred cases.
    assert leaves <= 4


def test_scatter_of_curves_that_are_too_short_for_a_roughness_claims_no_failure() -> None:
    leaves, ratio = 0, []
    for seed in range(100):
        short = [
            replace(item, curves=tuple(
                curve.where(slice(-2, None)) for curve in item.curves
            ))
            for item in families(np.random.default_rng(seed))
        ]  # fmt: skip
        noise = estimate_repeat_errors(campaign(), short).noise["tip", 1]
        assert noise.source == "scatter"
        own = LEVELS[-1] * RESONANCE[-2:]
        ratio.append((noise.deviation(own) / (NOISE * own)) ** 2)
        for item in short:
            closed = PredictedBand(
                frequency=FREQUENCY, value=np.tile(item.level * RESONANCE, (2, 1)), deviation=np.zeros((2, 6)),
                jump=np.zeros((2, 6), dtype=bool),
            )  # fmt: skip
            leaves += judge_family(
                item, closed, noise, shift=0.0, n_reading=sum(entry.n_point for entry in short)
            ).leaves_band
    # Without histories scatter is noise: 18 degrees of freedom each, a standard error of 0.033 of the mean of 100. The
    # absolute part, which is never negative, takes some of the variance where there is none, as above.
    assert 0.85 < np.mean(ratio) < 1.05
    # As above: a mean of 2, and no more than 6 in 99 of a hundred cases.
    assert leaves <= 6


def test_one_short_curve_tells_no_noise() -> None:
    random = np.random.default_rng(0)
    one = [replace(item, curves=(item.curves[0].where(slice(0, 2)),)) for item in families(random)]
    assert estimate_repeat_errors(campaign(), one).noise["tip", 1].source == "unknown"


def test_curves_share_a_frequency_that_the_longest_has_not() -> None:
    random = np.random.default_rng(1)
    split = [
        replace(item, curves=tuple(
            curve.where(own)
            for curve, own in zip(item.curves, (slice(4), slice(4), slice(3, 6), slice(3, 6)), strict=True)
        ))
        for item in families(random)
    ]  # fmt: skip
    point = number_points(split[0].curves)
    # Four frequencies of the first two curves; the last of them and two new ones of the others.
    assert point.tolist() == [0, 1, 2, 3, 0, 1, 2, 3, 3, 4, 5, 3, 4, 5]
    assert estimate_repeat_errors(campaign(), split).noise["tip", 1].source == "curves"


def test_readings_that_agree_to_the_last_digit_leave_the_noise_of_others() -> None:
    values = (1.0, 1.0, 1.02)
    few = Family(
        sensor="tip", harmonic=1, level=1.0,
        curves=tuple(
            FamilyCurve(test="t", repeat=number, sweep=1, frequency=FREQUENCY[:3], value=np.array(value))
            for number, value in enumerate(((1.0, 1.0, 1.0), values))
        ),
    )  # fmt: skip
    noise = estimate_repeat_errors(campaign(), [few]).noise["tip", 1]
    assert noise.source == "scatter"
    assert noise.deviation(np.ones(1))[0] > 0
    assert np.isfinite(noise.covariance).all()


def test_a_place_that_comes_between_takes_no_reading_from_another() -> None:
    curves = [
        FamilyCurve(test="t", repeat=number, sweep=1, frequency=np.array(at), value=np.ones(len(at)))
        for number, at in enumerate(([100.0, 110.0, 120.0], [102.0, 112.0, 122.0], [104.1, 114.1]))
    ]
    point = number_points(curves)
    assert point[:6].tolist() == [0, 1, 2, 0, 1, 2]
    assert len(set(point[6:]) | {0, 1, 2}) == 5


def test_a_factor_of_a_repeat_is_an_error_of_its_readings() -> None:
    random, factor = np.random.default_rng(4), np.array([1.004, 0.996, 1.002, 0.998])
    measured = [
        replace(item, curves=tuple(replace(curve, value=curve.value * factor[curve.repeat]) for curve in item.curves))
        for item in eight_curves(random, 1e-3)
    ]
    noise = estimate_repeat_errors(campaign(), measured).noise["tip", 1]
    # Standard deviation of the four factors times the caution about so few, and a little noise.
    expected = float(np.sqrt(factor.var(ddof=1) * compute_margin(3)))
    assert noise.gain == pytest.approx(expected, rel=0.2)
    assert noise.relative == pytest.approx(1e-3, rel=0.3)


def test_histories_that_differ_at_one_level_are_no_gain() -> None:
    measured = eight_curves(np.random.default_rng(5), 1e-3)
    apart = replace(
        measured[2],
        curves=tuple(replace(curve, value=curve.value * (1 + 0.1 * curve.repeat)) for curve in measured[2].curves),
    )
    assert estimate_repeat_errors(campaign(), [*measured[:2], apart]).noise["tip", 1].gain < 1e-3
    # More than a calibration may be off is no gain either.
    assert estimate_repeat_errors(campaign(), [apart]).noise["tip", 1].gain == MOST_GAIN
