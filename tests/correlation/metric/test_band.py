"""A band beside repeated tests: what counting by hand, quantiles and expectations in closed form say."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.metric.band import coverage, interval_score, tightness

NAN = np.nan
LOWER, UPPER = np.array([1.0, 2.0, 0.0]), np.array([2.0, 4.0, 0.0])
#: Four repeats at three points; the ends of the band belong to it.
MEASURED = np.array([[1.0, 4.5, 0.0], [2.0, 3.0, NAN], [0.5, 2.0, NAN], [1.5, 4.0, 0.0]])


def test_coverage_is_the_share_that_is_counted_by_hand() -> None:
    assert coverage(MEASURED, LOWER, UPPER) == 8 / 10


def test_tightness_is_width_over_range() -> None:
    result = tightness(MEASURED, LOWER, UPPER)
    assert result[:2].tolist() == [1 / 1.5, 2 / 2.5]
    assert np.isnan(result[2])  # no width and no spread
    assert tightness(np.array([[3.0], [3.0]]), np.array([2.0]), np.array([4.0])).tolist() == [np.inf]
    assert np.isnan(tightness(np.array([[3.0], [NAN]]), np.array([2.0]), np.array([4.0]))).all()


def test_a_point_inside_costs_the_width_and_one_outside_two_over_alpha_of_its_distance_more() -> None:
    result = interval_score(MEASURED, LOWER, UPPER, alpha=0.1)
    assert result[:, 0] == pytest.approx([1, 1, 1 + 20 * 0.5, 1])
    assert result[:, 1] == pytest.approx([2 + 20 * 0.5, 2, 2, 2])
    assert np.isnan(result[1, 2])


@given(
    x=st.floats(-10, 10), low=st.floats(-5, 5), width=st.floats(0, 5), alpha=st.floats(0.01, 0.99),
    by=st.floats(-3, 3), factor=st.floats(0.1, 10),
)  # fmt: skip
def test_the_score_is_in_the_unit_of_the_points_and_knows_no_origin(
    x: float, low: float, width: float, alpha: float, by: float, factor: float
) -> None:
    def score(x: float, low: float, high: float) -> float:
        return float(interval_score(np.array([[x]]), np.array([low]), np.array([high]), alpha)[0, 0])

    plain = score(x, low, low + width)
    # Rounding of sums of numbers up to 20, times 2 / alpha.
    near = pytest.approx(plain, rel=1e-9, abs=1e-10)
    assert score(x + by, low + by, low + by + width) == near
    assert score(factor * x, factor * low, factor * (low + width)) / factor == near
    assert score(-x, -low - width, -low) == near


@pytest.mark.parametrize("alpha", [0.05, 0.5])
def test_the_band_between_the_true_quantiles_scores_best_and_as_much_as_the_integral_says(alpha: float) -> None:
    # Uniform on (0, 1): the score of (q, 1 - q) is 1 - 2 q + (2 / alpha) q^2 on average, least at q = alpha / 2.
    n = 4000
    x = (np.arange(n) + 0.5)[:, None] / n

    def mean(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
        return interval_score(np.tile(x, len(low)), low, high, alpha).mean(axis=0)

    q = np.linspace(0, 0.5, 101)
    # The midpoint rule is exact but for the two cells with a kink: 2 / alpha times an area of 1 / (4 n^2) each at most.
    np.testing.assert_allclose(mean(q, 1 - q), 1 - 2 * q + 2 / alpha * q**2, atol=1 / (alpha * n**2))
    assert q[np.argmin(mean(q, 1 - q))] == pytest.approx(alpha / 2, abs=1e-12)
    # Neither end alone can be moved to advantage: the rule is proper.
    best = float(mean(np.array([alpha / 2]), np.array([1 - alpha / 2]))[0])
    moved = np.array([-0.02, -0.005, 0.005, 0.02])
    assert (mean(alpha / 2 + moved, np.full(4, 1 - alpha / 2)) > best).all()
    assert (mean(np.full(4, alpha / 2), 1 - alpha / 2 + moved) > best).all()


@pytest.mark.parametrize(
    ("measured", "lower", "upper", "message"),
    [
        ([[1.0, 2.0]], [0.0], [3.0], r"measured has shape \(1, 2\), lower \(1,\) and upper \(1,\): give \(n, p\)"),
        ([1.0, 2.0], [0.0], [3.0], r"measured has shape \(2,\)"),
        ([[NAN]], [0.0], [3.0], "no point of the band was measured: give at least one"),
        ([[1.0, 1.0]], [0.0, 4.0], [3.0, 3.5], "from 4 to 3.5 at point 1: give a lower end"),
        ([[1.0, 1.0]], [0.0, NAN], [3.0, 3.5], "from nan to 3.5 at point 1"),
    ],
)
def test_a_band_that_does_not_fit_is_refused(
    measured: list[float], lower: list[float], upper: list[float], message: str
) -> None:
    for compare in (coverage, tightness, lambda *band: interval_score(*band, 0.1)):
        with pytest.raises(CampaignError, match=message):
            compare(np.array(measured), np.array(lower), np.array(upper))


@pytest.mark.parametrize("alpha", [0.0, 1.0, -0.1, NAN])
def test_an_alpha_that_is_no_share_is_refused(alpha: float) -> None:
    with pytest.raises(CampaignError, match=f"alpha = {alpha:g} must lie between 0 and 1: 0.05 scores"):
        interval_score(MEASURED, LOWER, UPPER, alpha)
