"""How large the best gain is by chance: exact distributions of independent, parallel and one-sided candidates."""

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from diagnosis.candidate.effect import EffectParameter
from diagnosis.screening import Score
from diagnosis.threshold.detection_threshold import DRAWS, draw_null_gains, find_threshold

BOTH = EffectParameter(name="p", unit="-", lower=-1.0, upper=1.0, typical=0.1)
UP = EffectParameter(name="p", unit="-", lower=0.0, upper=1.0, typical=0.1)
DOWN = EffectParameter(name="p", unit="-", lower=-1.0, upper=0.0, typical=-0.1)


def scores(directions: np.ndarray, parameters: Sequence[EffectParameter], size: float = 1.0) -> list[Score]:
    return [
        Score(
            effect=SimpleNamespace(name=f"effect {number}", parameters=(parameter,)),  # type: ignore[arg-type]
            strength=0.0, gain=0.0, size=size, absorbed=0.0, direction=direction,
            start=np.zeros(1), slope=np.zeros_like(direction),
        )
        for number, (direction, parameter) in enumerate(zip(directions, parameters, strict=True))
    ]  # fmt: skip


def check(gains: np.ndarray, distribution) -> None:
    """Kolmogorov and Smirnov: 1.95 / sqrt(n) is exceeded by chance once in a thousand seeds."""
    x = np.linspace(0.1, 25, 200)
    empirical = np.searchsorted(gains, x, side="right") / len(gains)
    assert len(gains) == DRAWS
    assert np.abs(empirical - distribution(x)).max() < 1.95 / np.sqrt(DRAWS)


@pytest.mark.parametrize("n", [1, 8])
def test_orthogonal_directions_are_independent_chi_squares(n: int) -> None:
    directions = np.linalg.qr(np.random.default_rng(1).standard_normal((40, n)))[0].T
    gains = draw_null_gains(scores(directions, [BOTH] * n))
    check(gains, lambda x: chi2.cdf(x, 1) ** n)
    exact = chi2.ppf(0.95 ** (1 / n), 1)
    # A quantile of 20 000 draws: standard deviation sqrt(p (1 - p) / n) / density, some 2 % here.
    assert find_threshold(gains, 0.05) == pytest.approx(exact, rel=0.08)


def test_parallel_directions_count_once() -> None:
    direction = np.ones(25) / 5
    check(draw_null_gains(scores(np.array([direction, -direction, direction]), [BOTH] * 3)), lambda x: chi2.cdf(x, 1))


@pytest.mark.parametrize("parameter", [UP, DOWN])
def test_a_bound_halves_the_chances(parameter: EffectParameter) -> None:
    gains = draw_null_gains(scores(np.eye(3), [parameter] * 3))
    check(gains, lambda x: (0.5 + 0.5 * chi2.cdf(x, 1)) ** 3)


def test_opposite_bounds_along_one_direction_make_both_sides() -> None:
    """A direction is towards the typical strength; up along d and up along -d are two halves of one chi-square."""
    direction = np.eye(4)[0]
    check(draw_null_gains(scores(np.array([direction, -direction]), [UP, UP])), lambda x: chi2.cdf(x, 1))


def test_what_is_unseen_gains_nothing() -> None:
    np.testing.assert_array_equal(draw_null_gains(scores(np.zeros((2, 5)), [BOTH] * 2, size=0.0)), [0.0])
    np.testing.assert_array_equal(draw_null_gains([]), [0.0])


def test_gains_rise_and_are_reproducible() -> None:
    some = scores(np.eye(4), [BOTH, UP, DOWN, BOTH])
    gains = draw_null_gains(some)
    assert (np.diff(gains) >= 0).all()
    np.testing.assert_array_equal(gains, draw_null_gains(some))
    assert find_threshold(gains, 0.01) > find_threshold(gains, 0.1)
