"""Features: F / X of motions, ratios to the largest motion, means as they are; their slopes are their derivatives."""

import numpy as np
import pytest

from correlation.feature_vector import FeatureVector
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
    return FeatureVector.of(points, VALUE, MOTION)


def complex_of(numbers: np.ndarray) -> np.ndarray:
    return numbers[:6] + 1j * np.concatenate([numbers[6:], [0.0]])


def test_features_of_every_kind(features: FeatureVector) -> None:
    found = complex_of(features.of_values(VALUE))
    # Row 1 is the largest fundamental of its state; the free state's own is row 0. Round-off alone.
    expected = [LEVEL / VALUE[0], LEVEL / VALUE[1], LEVEL / VALUE[2], VALUE[3] / VALUE[1], VALUE[4] / VALUE[1], 11.0]
    np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_features_of_several_sets_are_those_of_each(features: FeatureVector) -> None:
    sets = np.column_stack([VALUE, 2 * VALUE, VALUE * np.exp(0.3j)])
    found = features.of_values(sets)
    for number in range(3):
        np.testing.assert_array_equal(found[:, number], features.of_values(sets[:, number]))


def test_each_number_knows_its_row(features: FeatureVector) -> None:
    np.testing.assert_array_equal(features.row, [0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4])


def test_slopes_are_derivatives_of_features(features: FeatureVector) -> None:
    draw = np.random.default_rng(3)
    slopes = draw.standard_normal((6, 3)) + 1j * draw.standard_normal((6, 3))
    slopes[5] = slopes[5].real
    step = 1e-6
    found = features.slopes(VALUE, slopes)
    for number in range(3):
        ends = [features.of_values(VALUE + side * step * slopes[:, number]) for side in (-1, 1)]
        # Central differences: step^2 of curvature, and 1e-16 / step of round-off.
        np.testing.assert_allclose(found[:, number], (ends[1] - ends[0]) / (2 * step), rtol=1e-7, atol=1e-8)


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
    alone = FeatureVector.of(points, np.array([3 + 4j]), np.array([False]))
    np.testing.assert_array_equal(alone.of_values(np.array([3 + 4j])), [3.0, 4.0])
