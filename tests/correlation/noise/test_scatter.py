"""What repeats say: known noise and known jitter come back within the chances of a chi-square distribution."""

from types import ModuleType

import numpy as np
import pytest
from scipy.stats import chi2

from correlation.errors import CampaignError
from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.model import Model
from correlation.noise.nuisance import Budget, ModelFeatures, make_nuisance_modes
from correlation.noise.scatter import (
    COMMON_SCATTER,
    POOLED_FREEDOM,
    Scatter,
    _estimate_bias,
    _estimate_excess_scatter,
    _fit_median_law,
    estimate_scatter,
)
from correlation.prediction import Points, Prediction, Predictor

#: Relative, of the frequency of either test: it moves readings by 1 %, ten times the noise, straight on to 1e-4.
JITTER = (4e-4, 2e-4)


class Bench:
    """Repeats with noise of each reading's own and modes of jitter, linear by construction."""

    def __init__(self, model: Model, paper: ModuleType) -> None:
        self.points = paper.make_points(model)
        predictor = Predictor(points=self.points)
        self.prediction: Prediction = predictor.predict(model)
        motion = np.isin(self.points.sensor, ["tip", "root"])
        self.motion = motion
        self.features = FeatureVector.choose(self.points, self.prediction.value, motion)
        self.deviation = paper.make_deviation(self.points, self.prediction.value)
        nominal = ModelFeatures(predictor, self.features, model, self.prediction)
        self.modes = make_nuisance_modes(nominal, Budget(), ()).jitter[:2]
        self.slopes = [self.slope(predictor, model, number) for number in range(2)]
        self.expected = self.variance()
        self.none = np.zeros((len(self.features.row), 0))

    def variance(self) -> np.ndarray:
        """Of the features of one repeat: each reading's own noise, and that of the motion that a ratio refers to."""
        value, features = self.prediction.value, self.features
        variance = (self.deviation[features.row] * features.per_reading(value)) ** 2
        to = features.reference[features.row]
        shared = np.abs(value[features.row]) / np.abs(value[to]) ** 2 * self.deviation[to]
        return np.asarray(variance + np.where(to >= 0, shared, 0.0) ** 2)

    def slope(self, predictor: Predictor, model: Model, number: int) -> np.ndarray:
        """d reading / d shift, by differences."""
        configuration, step = ("jointed", "free")[number], 1e-5
        ends = [
            predictor.predict(model.with_frequency_shift(configuration, side * step), self.prediction).value
            for side in (-1, 1)
        ]
        return (ends[1] - ends[0]) / (2 * step)

    def observed(self, n: int, seed: int, jitter: tuple[float, float] = (0.0, 0.0)) -> Observation:
        generator, k = np.random.default_rng(seed), len(self.points)
        real, imaginary = generator.standard_normal((2, k, n))
        noise = self.deviation[:, None] * (real + 1j * imaginary * (self.points.harmonic > 0)[:, None])
        value = self.prediction.value[:, None] + noise
        for slope, size in zip(self.slopes, jitter, strict=True):
            value = value + slope[:, None] * size * generator.standard_normal(n)
        return Observation(points=self.points, repeat=value, motion=self.motion, taken=np.ones((k, n), dtype=bool))

    def scatter(self, observed: Observation) -> Scatter:
        return estimate_scatter(observed, self.features, self.modes, self.none, self.none)


@pytest.fixture(scope="module")
def bench(small: Model, paper: ModuleType) -> Bench:
    return Bench(small, paper)


def test_known_noise_comes_back(bench: Bench) -> None:
    n = 40
    ratio = bench.scatter(bench.observed(n, 2)).whitening.deviation ** 2 * n / bench.expected
    # A variance of n repeats is chi-square with n - 1 = 39 degrees of freedom, a relative standard deviation of 0.23:
    # none of some 180 strays beyond 4.5 of them.
    assert (np.abs(ratio - 1) < 4.5 * 0.23).all()
    # Their mean; numbers that share a reference are not independent, so that they count for a fifth.
    assert ratio.mean() == pytest.approx(1, abs=4 * 0.23 / np.sqrt(len(ratio) / 5))


def test_four_repeats_are_pooled(bench: Bench) -> None:
    """With three degrees of freedom of its own and six pooled ones, no point's variance is off by much."""
    ratio = np.array(
        [bench.scatter(bench.observed(4, seed)).whitening.deviation ** 2 * 4 / bench.expected for seed in range(10)]
    )
    # A share of 3 / 9 with a relative standard deviation of sqrt(2 / 3) gives 0.27, the fitted a^2 and b^2 some more;
    # alone it would be 0.82.
    assert np.std(ratio) < 0.5
    assert ratio.mean() == pytest.approx(1, abs=4 * 0.82 / np.sqrt(ratio.size / 5))


def test_known_jitter_comes_back(bench: Bench) -> None:
    n = 40
    seen = bench.scatter(bench.observed(n, 3, JITTER))
    for covariance, size in zip(seen.jitter, JITTER, strict=True):
        assert covariance.shape == (1, 1)
        # A chi-square of 39 degrees of freedom over that which 80 % exceed; one in 1e5 is beyond either end. The noise
        # adds 1e-3 of a width over many points: little.
        least, most = chi2.ppf([1e-5, 1 - 1e-5], 39) / chi2.ppf(0.2, 39)
        assert least * size**2 < float(covariance[0, 0]) < most * size**2


@pytest.mark.parametrize("n_repeat", [3, 5])
def test_jitter_is_seldom_larger_than_the_covariance_reckons_with(bench: Bench, n_repeat: int) -> None:
    """Four times in five, whatever a few repeats happen to be."""
    many = 80
    every = [bench.scatter(bench.observed(n_repeat, seed, JITTER)) for seed in range(many)]
    for cause, size in enumerate(JITTER):
        mode = bench.modes[cause][:, 0]
        # The modes of the mean come first, each along what its cause changes.
        shares = [float(mode @ item.whitening.modes[:, cause] / (mode @ mode)) ** 2 * n_repeat for item in every]
        covered = np.mean([share > size**2 for share in shares])
        assert covered == pytest.approx(0.8, abs=3 * np.sqrt(0.8 * 0.2 / many))


def test_repeats_of_another_test_say_nothing_of_a_jitter(bench: Bench) -> None:
    observed = bench.observed(5, 3, JITTER)
    free = observed.points.free

    def of(n_free: int, n_jointed: int) -> float:
        """Variance of the free test's frequency where each test has so many repeats."""
        repeat, taken = observed.repeat.copy(), observed.taken.copy()
        for rows, n in ((free, n_free), (~free, n_jointed)):
            repeat[rows, n:], taken[rows, n:] = np.nan, False
        columns = slice(max(n_free, n_jointed))
        some = Observation(
            points=observed.points, repeat=repeat[:, columns], motion=observed.motion, taken=taken[:, columns]
        )
        return float(bench.scatter(some).jitter[1][0, 0])

    # The noise of the jointed test alone is told better by five repeats, and weighs nothing in the free one.
    assert of(2, 5) == pytest.approx(of(2, 2), rel=1e-6)


def test_jitter_is_taken_out_of_the_noise(bench: Bench) -> None:
    still = bench.scatter(bench.observed(40, 4)).whitening.deviation
    moved = bench.scatter(bench.observed(40, 4, (3e-4, 3e-4))).whitening.deviation
    fundamental = bench.features.inverse[bench.features.row]
    # The same draws of noise, in another order of the generator: both are within their chances of 0.23 / 2 each.
    assert np.median(moved[fundamental] / still[fundamental]) == pytest.approx(1, abs=0.1)


def test_the_mean_is_as_uncertain_as_its_repeats_are_many(bench: Bench) -> None:
    """The covariance is that of the mean of the repeats taken, whichever tell the noise."""
    every = bench.observed(8, 5, JITTER)
    taken = every.taken.copy()
    taken[:, 2:] = False
    few = Observation(points=every.points, repeat=every.repeat, motion=every.motion, taken=taken)
    all_of_them, two = bench.scatter(every), bench.scatter(few)
    # Round-off.
    np.testing.assert_allclose(two.whitening.deviation, 2 * all_of_them.whitening.deviation, rtol=1e-12)
    np.testing.assert_allclose(two.whitening.modes, 2 * all_of_them.whitening.modes, rtol=1e-12)
    np.testing.assert_allclose(two.jitter[0], all_of_them.jitter[0], rtol=1e-12)


def test_the_whitened_mean_is_standard_normal(bench: Bench) -> None:
    n = 30
    exact = bench.features.of_values(bench.prediction.value)
    squares = []
    for seed in range(5):
        observed = bench.observed(n, 20 + seed, JITTER)
        whitened = bench.scatter(observed).whitening(bench.features.of_values(observed.value) - exact)
        squares.append(whitened**2)
    # Some 900 squares, chi-square(1) each, a standard deviation of sqrt(2 / 900) = 0.05 of their mean; the estimated
    # variances (29 degrees of freedom) raise it by 2 / 29, numbers that share a reference correlate: twice that.
    assert np.mean(squares) == pytest.approx(1 + 2 / 29, abs=0.2)


def test_one_repeat_is_refused(bench: Bench) -> None:
    with pytest.raises(CampaignError, match="repeat the test"):
        bench.scatter(bench.observed(1, 6))


def test_numbers_of_a_state_that_scatters_more_are_all_less_certain(bench: Bench) -> None:
    """Where slip sets in, one number may agree between a few repeats by chance; it counts no more than the others."""
    n, times = 8, 3.0
    calm, points = bench.observed(n, 31), bench.points
    rows = ~points.free & (points.level == 3.0) & (points.frequency == 25.0)
    mean = calm.repeat.mean(axis=1)[:, None]
    repeat = np.where(rows[:, None], mean + times * (calm.repeat - mean), calm.repeat)
    scattered = Observation(points=points, repeat=repeat, motion=calm.motion, taken=calm.taken)
    before, after = (bench.scatter(item).whitening.deviation for item in (calm, scattered))
    ratio, here = after / before, rows[bench.features.row]
    # 11 numbers of 7 degrees of freedom say that the variance is 9 times as large (see `MOST_EXCESS_SCATTER`), against
    # COMMON_SCATTER * POOLED_FREEDOM = 24 that it is not: (24 + 77 * 9) / (24 + 77) = 7, of which half are three
    # standard deviations.
    assert ratio[here].min() > np.sqrt(7 / 2)
    # At most all of it, and the chances of either factor: two standard deviations of 16 % of both variances; and the
    # median of a dozen numbers, by which a group is scaled, moves by a quarter when one of them does.
    assert ratio[here].max() < 1.32 * 1.25 * times
    # The pooled variance of a group of 12 or 24 readings rises with one of them, and by chance.
    assert np.median(ratio[~here]) == pytest.approx(1, abs=0.1)
    assert ratio[~here].max() < ratio[here].min()


def test_numbers_of_one_law_are_as_certain_as_each_other() -> None:
    n_state, n_number, freedom = 200, 11, 3.0
    state = np.tile(np.arange(n_state), n_number)
    ratio = np.random.default_rng(8).chisquare(freedom, len(state)) / freedom
    factor = _estimate_excess_scatter(ratio, np.full(len(state), freedom), state)
    # Chi-square of 33 degrees of freedom beside 24 that are 1: a standard deviation of sqrt(66) / 57 = 0.14. None of
    # 200 strays beyond four of them; alone it would be 0.25.
    assert np.abs(factor - 1).max() < 4 * 0.14
    assert np.std(factor[:n_state]) == pytest.approx(0.14, rel=4 / np.sqrt(2 * n_state))
    assert factor.mean() == pytest.approx(1, abs=4 * 0.14 / np.sqrt(n_state))


@pytest.mark.parametrize("freedom", [1.0, 2.0, 4.0])
def test_the_pooled_variance_is_that_of_noise_for_any_number_of_repeats(freedom: float) -> None:
    random, n = np.random.default_rng(9), 400
    size = random.uniform(0.5, 2.0, n)
    exact = (0.1 * size) ** 2 + 0.05**2
    variance, mean_square = exact * random.chisquare(freedom, n) / freedom, float(np.mean(size**2))
    share = _fit_median_law(variance, size, np.full(n, freedom), mean_square)
    pooled = share[0] * size**2 + share[1] * mean_square
    # The median of 400 chi-squares of one degree of freedom is known to 12 %.
    assert np.mean(pooled / exact) == pytest.approx(1, abs=4 * 0.12 / np.sqrt(freedom))


def test_numbers_without_repeats_say_nothing_of_their_state() -> None:
    state = np.array([0, 0, 1, 1, 2])
    freedom = np.array([3.0, 0.0, 3.0, 3.0, 0.0])
    factor = _estimate_excess_scatter(np.array([9.0, np.nan, 1.0, 1.0, np.nan]), freedom, state)
    alike = COMMON_SCATTER * POOLED_FREEDOM
    # They are as uncertain as the rest of it all the same; round-off.
    np.testing.assert_allclose(factor[:2], (alike + 27) / (alike + 3), rtol=1e-14)
    np.testing.assert_array_equal(factor[2:], 1.0)


def test_moduli_without_a_phase_have_a_mode_of_their_bias() -> None:
    k, ones = 2, np.ones(2)
    points = Points(
        free=np.zeros(k, dtype=bool), level=ones, frequency=ones, sensor=np.array(["tip", "tip"]),
        harmonic=np.array([1, 3]),
    )  # fmt: skip
    moduli = FeatureVector.choose(points, ones.astype(complex), np.ones(k, bool), np.zeros(k, bool))
    np.testing.assert_allclose(_estimate_bias(moduli, 3 * ones, 2 * ones), [[0.0], [3.0]])
    phased = FeatureVector.choose(points, ones.astype(complex), np.ones(k, bool))
    assert _estimate_bias(phased, np.ones(4), np.ones(4)).shape == (4, 0)


@pytest.mark.parametrize("n_reading", [1, 2, 4])
def test_a_harmonic_of_noise_alone_is_bias_for_means_of_several_readings(n_reading: int) -> None:
    n_frequency, n_repeat, random = 60, 3, np.random.default_rng(7)
    parts = random.standard_normal((2, 2 * n_frequency, n_repeat, n_reading))
    true = np.repeat([100.0, 0.0], n_frequency)
    repeat = np.abs(true[:, None, None] + parts[0] + 1j * parts[1]).mean(axis=2)
    points = Points(
        free=np.zeros(len(true), dtype=bool), level=np.ones(len(true)), frequency=np.tile(np.arange(60.0), 2),
        sensor=np.repeat("tip", len(true)), harmonic=np.repeat([1, 3], n_frequency),
    )  # fmt: skip
    unphased, motion = np.zeros(len(true), dtype=bool), np.ones(len(true), dtype=bool)
    seen = Observation(
        points=points, repeat=repeat.astype(complex), motion=motion, taken=np.isfinite(repeat), phased=unphased,
        n_reading=np.full(len(true), n_reading),
    )  # fmt: skip
    features, none = FeatureVector.choose(points, seen.value, motion, unphased), np.zeros((len(true), 0))
    modes = estimate_scatter(seen, features, [none], none, none).whitening.modes
    # A reading that is large by chance is taken for some motion: a fifth of the mean at most here.
    assert modes[n_frequency:, -1].mean() > 0.75 * features.of_values(seen.value)[n_frequency:].mean()
