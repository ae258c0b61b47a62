"""Features: F / X of motions, ratios to the largest motion, means as they are; their slopes are their derivatives."""

import numpy as np
import pytest

from correlation.feature.vector import FeatureVector
from correlation.prediction import Points

#: Free: one motion. Jointed: two motions, a harmonic, a force and its mean.
FREE = np.array([True, False, False, False, False, False])
HARMONIC = np.array([1, 1, 1, 3, 1, 0])
MOTION = np.array([True, True, True, True, False, False])
VALUE = np.array([2 + 1j, 3 - 1j, 0.5 + 0.5j, 0.1 + 0.2j, 7 - 3j, 11 + 0j])
LEVEL = 5.0


@pytest.fixture(scope="module")
def features() -> FeatureVector:
    points = Points(
        free=FREE,
        level=np.full(6, LEVEL),
        frequency=np.full(6, 20.0),
        sensor=np.array(["a", "a", "b", "a", "T", "N"]),
        harmonic=HARMONIC,
    )
    return FeatureVector.choose(points, VALUE, MOTION)


def complex_of(numbers: np.ndarray) -> np.ndarray:
    return numbers[:6] + 1j * np.concatenate([numbers[6:], [0.0]])


def test_features_of_every_kind(features: FeatureVector) -> None:
    result = complex_of(features.of_values(VALUE))
    # Row 1 is the largest fundamental of its state; the free state's own is row 0. Round-off alone.
    expected = [LEVEL / VALUE[0], LEVEL / VALUE[1], LEVEL / VALUE[2], VALUE[3] / VALUE[1], VALUE[4] / VALUE[1], 11.0]
    np.testing.assert_allclose(result, expected, rtol=1e-14)


def test_features_of_several_sets_are_those_of_each(features: FeatureVector) -> None:
    sets = np.column_stack([VALUE, 2 * VALUE, VALUE * np.exp(0.3j)])
    result = features.of_values(sets)
    for number in range(3):
        np.testing.assert_array_equal(result[:, number], features.of_values(sets[:, number]))


def test_values_are_those_of_their_features(features: FeatureVector) -> None:
    back = features.values(features.of_values(VALUE))
    np.testing.assert_allclose(back, np.where(features.real_only, VALUE.real, VALUE), rtol=1e-14)


def test_each_number_knows_its_row(features: FeatureVector) -> None:
    np.testing.assert_array_equal(features.row, [0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4])


def test_slopes_are_derivatives_of_features(features: FeatureVector) -> None:
    draw = np.random.default_rng(3)
    slopes = draw.standard_normal((6, 3)) + 1j * draw.standard_normal((6, 3))
    slopes[5] = slopes[5].real
    step = 1e-6
    result = features.slopes(VALUE, slopes)
    for number in range(3):
        ends = [features.of_values(VALUE + side * step * slopes[:, number]) for side in (-1, 1)]
        # Central differences: step^2 of curvature, and 1e-16 / step of round-off.
        np.testing.assert_allclose(result[:, number], (ends[1] - ends[0]) / (2 * step), rtol=1e-7, atol=1e-8)


def test_per_reading_is_the_modulus_of_the_derivative_by_the_own_reading(features: FeatureVector) -> None:
    rate = features.per_reading(VALUE)
    for row in range(6):
        own = np.zeros((6, 1), dtype=complex)
        own[row] = 1.0
        size = np.abs(complex_of(features.slopes(VALUE, own)[:, 0])[row])
        # Row 1 is a motion, and refers to nothing but itself. Round-off alone.
        np.testing.assert_allclose(rate[features.row == row], size, rtol=1e-12)


def test_a_harmonic_without_a_motion_stays_as_it_is() -> None:
    points = Points(
        free=np.array([False]), level=np.array([2.0]), frequency=np.array([9.0]), sensor=np.array(["T"]),
        harmonic=np.array([1]),
    )  # fmt: skip
    alone = FeatureVector.choose(points, np.array([3 + 4j]), np.array([False]))
    np.testing.assert_array_equal(alone.of_values(np.array([3 + 4j])), [3.0, 4.0])


def readings(*names: str) -> Points:
    n = len(names)
    return Points(
        free=np.ones(n, dtype=bool), level=np.full(n, LEVEL), frequency=np.full(n, 20.0), sensor=np.array(names),
        harmonic=np.ones(n, dtype=np.int64),
    )  # fmt: skip


def test_the_mean_of_features_of_a_resonance_that_shifts_is_that_of_its_mean_place() -> None:
    """Repeats see the resonance off by +- d: the dynamic stiffness has the mean D; 1 / mean(1 / D) is not."""
    exact, shift = 30.0 + 40.0j, 5.0
    dynamic = exact + shift * np.array([[-1.0, 1.0, -0.5, 0.5]])
    repeat = LEVEL / dynamic
    features = FeatureVector.choose(readings("a"), repeat.mean(axis=1), np.array([True]))
    everything = np.ones_like(repeat, dtype=bool)
    mean = repeat.mean(axis=1)
    biased = features.of_values(mean)
    # Round-off.
    np.testing.assert_allclose(features.of_repeats(repeat, everything), [exact.real, exact.imag], rtol=1e-13)
    # The inverse of the mean is off by the variance of D over D, to the next order of shift / D.
    variance = np.var(dynamic)
    off = -variance / exact
    np.testing.assert_allclose(biased - [exact.real, exact.imag], [off.real, off.imag], rtol=0.02)


def test_where_noise_drowns_a_reading_the_mean_comes_first() -> None:
    """A reading that happens to be next to zero would make the mean of the inverses as large as one likes."""
    repeat = np.array([[0.1, 0.11, 1e-4 + 1e-4j]])
    features = FeatureVector.choose(readings("a"), repeat.mean(axis=1), np.array([True]))
    result = features.of_repeats(repeat, np.ones((1, 3), dtype=bool))
    np.testing.assert_allclose(result, features.of_values(repeat.mean(axis=1)), rtol=1e-14)
    assert np.abs(result).max() < 2 * LEVEL / 0.07


def test_ratios_are_averaged_as_ratios(features: FeatureVector) -> None:
    """All readings of a state grow together by 3 %, as with another gain of the exciter: its ratios do not change."""
    growth = np.array([0.97, 1.0, 1.03])
    repeat = VALUE[:, None] * growth
    result = complex_of(features.of_repeats(repeat, np.ones_like(repeat, dtype=bool)))
    once = complex_of(features.of_values(VALUE))
    np.testing.assert_allclose(result[3:5], once[3:5], rtol=1e-14)
    np.testing.assert_allclose(result[:3], once[:3] * np.mean(1 / growth), rtol=1e-14)
    np.testing.assert_allclose(result[5], once[5], rtol=1e-14)


def test_only_the_repeats_taken_count(features: FeatureVector) -> None:
    repeat = VALUE[:, None] * np.array([0.99, 7.0, 1.01, np.nan])
    taken = np.tile([True, False, True, False], (6, 1))
    expected = features.of_repeats(repeat[:, [0, 2]], np.ones((6, 2), dtype=bool))
    np.testing.assert_array_equal(features.of_repeats(repeat, taken), expected)
    # One alone is its own mean.
    one = features.of_repeats(repeat[:, :1], np.ones((6, 1), dtype=bool))
    np.testing.assert_allclose(one, features.of_values(repeat[:, 0]), rtol=1e-14)


def test_a_ratio_whose_reference_lacks_a_repeat_is_that_of_the_means(features: FeatureVector) -> None:
    repeat = VALUE[:, None] * np.array([0.99, 1.0, 1.01])
    repeat[1, 0] = np.nan
    result = complex_of(features.of_repeats(repeat, np.isfinite(repeat)))
    reference = repeat[1, 1:].mean()
    np.testing.assert_allclose(result[3:5], repeat[3:5].mean(axis=1) / reference, rtol=1e-14)
    assert np.isfinite(result).all()


def test_an_antiresonance_is_compared_as_a_share_of_the_reference() -> None:
    frequency = np.tile([90.0, 95.0, 100.0, 105.0, 110.0], 2)
    points = Points(
        free=np.zeros(10, dtype=bool),
        level=np.full(10, LEVEL),
        frequency=frequency,
        sensor=np.repeat(["tip", "mid"], 5),
        harmonic=np.ones(10, dtype=np.int64),
    )
    share = np.array([0.2, 0.1, 0.01j, -0.1, -0.2])
    tip = np.array([1.0, 2.0, 3 + 1j, 2.0, 1.0])
    value = np.concatenate([tip, share * tip])
    result = FeatureVector.choose(points, value, np.ones(10, dtype=bool))
    # 0.01 is far below 0.3 of the median share of 0.1; nothing else is, and the reference has no such place.
    np.testing.assert_array_equal(np.flatnonzero(~result.inverse), [7])
    assert result.fundamental.all()
    numbers = result.of_values(value)
    assert numbers[7] + 1j * numbers[17] == pytest.approx(share[2], rel=1e-14)
    np.testing.assert_allclose(result.values(numbers), value, rtol=1e-14)


@pytest.fixture(scope="module")
def moduli() -> FeatureVector:
    """As `features`; the motion "a" has no phase."""
    points = Points(
        free=FREE, level=np.full(6, LEVEL), frequency=np.full(6, 20.0), sensor=np.array(["a", "a", "b", "a", "T", "N"]),
        harmonic=HARMONIC,
    )  # fmt: skip
    return FeatureVector.choose(points, VALUE, MOTION, points.sensor != "a")


def test_a_sensor_without_phase_has_moduli(moduli: FeatureVector) -> None:
    result = moduli.of_values(VALUE)
    np.testing.assert_array_equal(moduli.row, [0, 1, 2, 3, 4, 5, 2, 4])
    # The force refers to the motion with a phase, row 2; the harmonic of "a" to the largest motion, row 1.
    force = VALUE[4] / VALUE[2]
    expected = [
        LEVEL / abs(VALUE[0]), LEVEL / abs(VALUE[1]), (LEVEL / VALUE[2]).real, abs(VALUE[3] / VALUE[1]), force.real,
        11.0, (LEVEL / VALUE[2]).imag, force.imag,
    ]  # fmt: skip
    np.testing.assert_allclose(result, expected, rtol=1e-14)
    turned = VALUE * np.where(moduli.amplitude, np.exp(1.3j), 1.0)
    np.testing.assert_allclose(moduli.of_values(turned), result, rtol=1e-14)


def test_slopes_of_moduli_are_their_derivatives(moduli: FeatureVector) -> None:
    draw = np.random.default_rng(3)
    slopes = draw.standard_normal((6, 3)) + 1j * draw.standard_normal((6, 3))
    slopes[5] = slopes[5].real
    step = 1e-6
    result = moduli.slopes(VALUE, slopes)
    for number in range(3):
        ends = [moduli.of_values(VALUE + side * step * slopes[:, number]) for side in (-1, 1)]
        # Central differences: step^2 of curvature, and 1e-16 / step of round-off.
        np.testing.assert_allclose(result[:, number], (ends[1] - ends[0]) / (2 * step), rtol=1e-7, atol=1e-8)


def test_values_of_moduli_have_no_phase(moduli: FeatureVector) -> None:
    back = moduli.values(moduli.of_values(VALUE))
    expected = np.where(moduli.amplitude, np.abs(VALUE), np.where(moduli.real_only, VALUE.real, VALUE))
    np.testing.assert_allclose(back, expected, rtol=1e-14)
