"""A state that is missed by far more than those beside it counts less; a misfit of many states counts whole."""

import numpy as np
import pytest
import scipy.stats

from correlation.feature.vector import FeatureVector
from correlation.metric.outlier import CHANCE, MIN_MEAN_SQUARE, MUCH, NEIGHBOURS, weigh_outliers
from correlation.prediction import Points

N, LARGE = 20, 50.0
#: Of three numbers: their mean square that chance exceeds, and the mean of squares whose median is 1.
TIMES = scipy.stats.chi2.isf(CHANCE, 3) / 3
WHOLE = 3 / scipy.stats.chi2.median(3)


def sweeps(*sizes: np.ndarray, free: tuple[bool, ...] | None = None) -> tuple[FeatureVector, np.ndarray, np.ndarray]:
    """One level after the other, its rows in any order of frequency; their residuals, and which state each is of.

    A state has a motion and a mean force, three numbers, whose mean square is the size given.
    """
    rows = []
    for place, item in enumerate(sizes):
        for number in np.random.default_rng(place).permutation(len(item)):
            rows += [(bool(free and free[place]), 1.0 + place, 20.0 + number, name) for name in ("tip", "left_N")]
    is_free, level, frequency, sensor = (np.array(column) for column in zip(*rows, strict=True))
    motion = sensor == "tip"
    points = Points(free=is_free, level=level, frequency=frequency, sensor=sensor, harmonic=motion.astype(np.int64))
    features = FeatureVector.choose(points, np.ones(len(points), dtype=np.complex128), motion)
    row = features.row
    which = np.column_stack([level[row] - 1, frequency[row] - 20]).astype(int)
    size = np.array([sizes[place][number] for place, number in which])
    # Unequal numbers, so that a state is judged by the mean of its squares.
    weight = np.where(np.arange(len(row)) >= len(points), 0.5, np.where(motion[row], 1.0, np.sqrt(1.75)))
    return features, np.sqrt(size) * weight, which


def factors(*sizes: np.ndarray, free: tuple[bool, ...] | None = None) -> list[np.ndarray]:
    """Of each state of each sweep; all numbers of a state must have the same."""
    features, residual, which = sweeps(*sizes, free=free)
    factor = weigh_outliers(features, residual)
    assert factor.shape == residual.shape
    result = []
    for level, size in enumerate(sizes):
        item = [factor[(which == (level, number)).all(axis=1)] for number in range(len(size))]
        assert all(len(numbers) == 3 and np.ptp(numbers) == 0 for numbers in item)
        result.append(np.array([numbers[0] for numbers in item]))
    return result


def alone(place: int, size: float, usual: float) -> np.ndarray:
    """One number among others that are all the same."""
    others = np.full(N, usual)
    others[place] = size
    return others


PLACE = np.arange(N)
RISING = LARGE * 0.9 ** (N - 1 - PLACE)
HILL = 1 + LARGE * np.exp(-((PLACE - 9) ** 2) / 16)


@pytest.mark.parametrize("size", [np.ones(N), RISING, RISING[::-1], HILL, 100 * HILL])
def test_a_smooth_misfit_counts_whole(size: np.ndarray) -> None:
    """Of a missing effect: at a resonance, or towards an end of the sweep."""
    np.testing.assert_array_equal(factors(size)[0], 1.0)


@pytest.mark.parametrize("width", [NEIGHBOURS // 2 + 1, NEIGHBOURS + 1])
def test_some_states_side_by_side_count_whole(width: int) -> None:
    """At either end of such a stretch half of those beside are as large, and their median is half as much."""
    size = np.ones(N)
    size[6 : 6 + width] = LARGE
    assert MUCH >= 2
    np.testing.assert_array_equal(factors(size)[0], 1.0)


@pytest.mark.parametrize("place", [0, 1, 8, N - 1])
def test_one_state_alone_counts_as_much_as_those_beside_it(place: int) -> None:
    size = alone(place, LARGE, 3.0)
    expected = alone(place, np.sqrt(LARGE / (3.0 * WHOLE)), 1.0)
    # Round-off.
    np.testing.assert_allclose(factors(size)[0], expected, rtol=1e-14)


@pytest.mark.parametrize(("times", "stands_out"), [(1.01, True), (0.99, False)])
def test_it_takes_more_than_chance_beside_the_median(times: float, stands_out: bool) -> None:
    size = alone(8, 3.0 * WHOLE * TIMES * times, 3.0)
    assert TIMES > MUCH
    assert bool(factors(size)[0][8] > 1) is stands_out


@pytest.mark.parametrize(("size", "stands_out"), [(0.99, False), (1.01, True)])
def test_what_noise_alone_would_do_does_not_stand_out(size: float, stands_out: bool) -> None:
    """Beside states that happen to fit too well: ten times their squares are still less than those of noise."""
    (result,) = factors(alone(8, size * MIN_MEAN_SQUARE * TIMES, 0.1))
    # Beyond it, it is judged by the least that counts as usual. Round-off.
    expected = np.sqrt(size * TIMES) if stands_out else 1.0
    np.testing.assert_allclose(result, alone(8, expected, 1.0), rtol=1e-14)


@pytest.mark.parametrize(("n_state", "judged"), [(NEIGHBOURS, False), (NEIGHBOURS + 1, True)])
def test_a_sweep_of_few_states_is_left_alone(n_state: int, judged: bool) -> None:
    size = np.where(np.arange(n_state) == 2, LARGE, 1.0)
    assert factors(size)[0].max() == (pytest.approx(np.sqrt(LARGE / WHOLE)) if judged else 1.0)


def test_those_beside_it_are_the_nearest_without_itself() -> None:
    """Three on either side, whose median is the mean of 3 and 4."""
    near, far = np.array([6.0, 1.0, 4.0, 3.0, 2.0, 5.0]), 1e3
    size, own = np.full(N, far), 3.75 * WHOLE * TIMES
    size[5:8], size[8], size[9:12] = near[:3], own, near[3:]
    # That is too much beside 3.5, but not beside 4, which is the median with itself. Round-off.
    assert factors(size)[0][8] == pytest.approx(np.sqrt(own / (3.5 * WHOLE)), rel=1e-14)


@pytest.mark.parametrize("free", [None, (False, True, False)])
def test_each_level_and_configuration_is_judged_by_itself(free: tuple[bool, ...] | None) -> None:
    """A level that is missed throughout does not stand out of the others, nor hide what does at their ends."""
    ends = (PLACE == 0) | (PLACE == N - 1)
    result = factors(np.ones(N), np.full(N, LARGE), np.where(ends, LARGE, 1.0), free=free)
    np.testing.assert_array_equal(result[0], 1.0)
    np.testing.assert_array_equal(result[1], 1.0)
    # Round-off.
    np.testing.assert_allclose(result[2], np.where(ends, np.sqrt(LARGE / WHOLE), 1.0), rtol=1e-14)


@pytest.mark.parametrize("n_sensor", [1, 2, 8])
def test_noise_hardly_stands_out_however_few_numbers_a_state_has(n_sensor: int) -> None:
    names = [f"sensor {number}" for number in range(n_sensor)]
    rows = [(1.0 + level, 20.0 + place, name) for level in range(100) for place in range(N) for name in names]
    level, frequency, sensor = (np.array(column) for column in zip(*rows, strict=True))
    points = Points(
        free=np.zeros(len(rows), dtype=bool), level=level, frequency=frequency, sensor=sensor,
        harmonic=np.ones(len(rows), dtype=np.int64),
    )  # fmt: skip
    features = FeatureVector.choose(points, np.ones(len(rows), dtype=np.complex128), np.ones(len(rows), dtype=bool))
    noise = np.random.default_rng(1).standard_normal(len(features.row))
    # The median of six scatters: that makes it three times as often, and of few numbers more so.
    assert np.mean(weigh_outliers(features, noise) > 1) < 5 * CHANCE
