"""Separation and the probability of a decision beside draws of measurements."""

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.noise.covariance import Whitening
from diagnosis.next_test.separation import compute_decision_probability, compute_separation

M, DRAWS = 12, 40_000
Matrix = NDArray[np.float64]


def make_system(scale: float) -> tuple[list[Matrix], list[Matrix], Whitening, Matrix]:
    """Three linear models with the same uncertain parameters, and the covariance of what they predict."""
    random = np.random.default_rng(3)
    errors = Whitening(deviation=random.uniform(0.5, 2, M), modes=random.standard_normal((M, 2)))
    spread = random.standard_normal((M, 3))
    means = [scale * random.standard_normal(M) for _ in range(3)]
    assert errors.modes is not None
    whole = np.diag(errors.deviation**2) + errors.modes @ errors.modes.T + spread @ spread.T
    return means, [spread] * 3, errors, whole


def draw_log_densities(means: list[Matrix], whole: Matrix, true: int) -> Matrix:
    """ln of the density of measurements by each model, up to a constant, shape (n, draws)."""
    random = np.random.default_rng(true)
    y = means[true][:, None] + np.linalg.cholesky(whole) @ random.standard_normal((M, DRAWS))
    away = [y - mean[:, None] for mean in means]
    return np.array([-np.sum(item * np.linalg.solve(whole, item), axis=0) / 2 for item in away])


def test_log_odds_of_draws_have_mean_half_of_d_squared_and_variance_d_squared() -> None:
    means, spreads, errors, whole = make_system(1.0)
    result = compute_separation(means, spreads, errors)
    density = draw_log_densities(means, whole, true=0)
    odds = density[0] - density[1]
    # Standard errors of mean and variance of normal draws, four of them.
    assert odds.mean() == pytest.approx(result[0, 1] / 2, abs=4 * np.sqrt(result[0, 1] / DRAWS))
    assert odds.var() == pytest.approx(result[0, 1], rel=4 * np.sqrt(2 / DRAWS))


@pytest.mark.parametrize("scale", [0.6, 1.0, 1.6])
def test_a_decision_between_two_models_is_as_probable_as_among_draws(scale: float) -> None:
    means, spreads, errors, whole = make_system(scale)
    share = np.array([0.7, 0.3])
    expected = compute_decision_probability(compute_separation(means[:2], spreads[:2], errors), share)
    decided = 0.0
    for true in range(2):
        weight = share[:, None] * np.exp(draw_log_densities(means[:2], whole, true))
        decided += share[true] * float(np.mean(weight[true] / weight.sum(axis=0) >= 0.95))
    # Four standard errors of a share of so many draws.
    assert decided == pytest.approx(expected, abs=4 * 0.5 / np.sqrt(DRAWS))


def test_of_three_models_it_is_a_lower_bound_that_is_near() -> None:
    means, spreads, errors, whole = make_system(1.6)
    share = np.array([0.5, 0.3, 0.2])
    bound = compute_decision_probability(compute_separation(means, spreads, errors), share)
    decided = 0.0
    for true in range(3):
        weight = share[:, None] * np.exp(draw_log_densities(means, whole, true))
        decided += share[true] * float(np.mean(weight[true] / weight.sum(axis=0) >= 0.95))
    # Both rivals have half of what is left to doubt: that costs up to ln 2 of log odds, and some per cent here.
    assert decided - 0.1 < bound <= decided + 4 * 0.5 / np.sqrt(DRAWS)


def test_what_uncertain_parameters_make_up_for_separates_nothing() -> None:
    means, spreads, errors, _ = make_system(1.0)
    along = [means[0], means[0] + spreads[0] @ np.array([1.0, -2.0, 0.5])]
    wide = [1e4 * spreads[0]] * 2
    # The deviation along the change is ten thousand times as large as the change.
    assert compute_separation(along, wide, errors)[0, 1] < 1e-6
    assert compute_separation(along, spreads[:2], errors)[0, 1] > 1


def test_numbers_that_one_model_lacks_separate_nothing() -> None:
    means, spreads, errors, _ = make_system(1.0)
    lacking = np.where(np.arange(M) < 5, np.nan, means[1])
    alone = compute_separation([means[0], np.where(np.arange(M) < 5, means[0], means[1])], spreads[:2], errors)
    result = compute_separation([means[0], lacking], spreads[:2], errors)[0, 1]
    # Numbers that both models predict alike still tell their parameters; without them less is separated.
    assert 0 < result < alone[0, 1]


def test_models_that_predict_the_same_are_not_decided_and_known_ones_are() -> None:
    nothing = np.zeros((2, 2))
    assert compute_decision_probability(nothing, np.array([0.5, 0.5])) == 0.0
    # 97 % are more than 95 %: it is decided already, and rightly in these 97 %.
    assert compute_decision_probability(nothing, np.array([0.97, 0.03])) == pytest.approx(0.97)
