"""Intervals of calibrated parameters: those of a quadratic score are known in closed form."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.fit.family_fit import LinearLimits
from diagnosis.fit.family_target import FamilyLimits
from study.estimate.resonance import MeasuredResonance
from study.paper.interval import (
    FREQUENCIES,
    LEAST_SQUARES,
    NEAR,
    PROFILE,
    RISE,
    Interval,
    Profile,
    find_damping_interval,
    find_density_interval,
)

HESSIAN = np.array([[4.0, 1.5, 0.0], [1.5, 1.0, 0.1], [0.0, 0.1, 0.3]])
MINIMUM = np.array([0.4, -0.3, 1.0])
PRIOR = np.array([5.0, 2.0, 8.0])


@dataclass(frozen=True, kw_only=True, eq=False)
class Quadratic(LinearLimits):
    """A score that is quadratic."""

    hessian: np.ndarray

    def score(self, scaled: np.ndarray) -> float:
        away = scaled - MINIMUM
        return float(away @ self.hessian @ away / 2) + 7.0


def profile(hessian: np.ndarray) -> Profile:
    nothing: Any = None
    return Profile(Quadratic(target=nothing, at=np.zeros(3), value=nothing, slopes=nothing, hessian=hessian), PRIOR)


def test_a_quadratic_score_gives_the_profile_interval_in_closed_form() -> None:
    whole = HESSIAN + np.diag(PRIOR**-2)
    centre, covariance = np.linalg.solve(whole, HESSIAN @ MINIMUM), np.linalg.inv(whole)
    for number, ends in enumerate(profile(HESSIAN).find_ends(number) for number in range(3)):
        half = TWO_SIDED_95 * np.sqrt(covariance[number, number])
        # The ends are told to NEAR, and the least of the others to a hundredth of a step.
        np.testing.assert_allclose(ends, [centre[number] - half, centre[number] + half], atol=2 * NEAR)


class Kinked(Quadratic):
    """A score with kinks across coupled parameters."""

    def score(self, scaled: np.ndarray) -> float:
        return float(np.abs(self.hessian @ (scaled - MINIMUM)).sum())


def test_a_score_with_kinks_gives_ends_that_linear_programming_gives() -> None:
    """With a prior that hardly counts, the profile of a sum of absolute values is RISE at the ends of a polytope."""
    steep = 4 * HESSIAN
    nothing: Any = None
    kinked = Profile(Kinked(target=nothing, at=np.zeros(3), value=nothing, slopes=nothing, hessian=steep), PRIOR)
    inverse = np.linalg.inv(steep)
    for number in range(3):
        # max |e_i^T H^-1 u| over |u|_1 <= RISE is at a corner.
        half = RISE * np.abs(inverse[number]).max()
        low, high = kinked.find_ends(number)
        # The prior narrows the ends by its share of the rise.
        assert high - low == pytest.approx(2 * half, rel=0.1)


class Moved(Quadratic):
    """A quadratic score whose minimum the limits move: their first number does it."""

    def score(self, scaled: np.ndarray) -> float:
        away = scaled - MINIMUM - self.value.ravel()[0]
        return float(away @ self.hessian @ away / 2)

    def with_limits(self, limits: FamilyLimits) -> "Moved":
        return replace(self, value=limits.value)


def test_drawn_histories_scatter_the_least_score_by_as_much_as_they_move_it() -> None:
    nothing: Any = None
    moved = Moved(target=nothing, at=np.zeros(3), value=np.zeros(1), slopes=nothing, hessian=HESSIAN)
    flat = np.full(3, np.inf)
    shifts = [-0.7, 0.2, 0.4, 1.1]
    deviation = Profile(moved, flat).find_deviation([FamilyLimits(np.array([item]), nothing) for item in shifts])
    # Without a prior all parameters of the minimum move by the shift of the limits; that of the fit has none.
    np.testing.assert_allclose(deviation, np.std([0.0, *shifts], ddof=1), atol=2 * NEAR)


def test_the_damping_ratio_has_the_interval_of_the_stuck_resonance() -> None:
    stuck = MeasuredResonance(
        free=False, frequency=250.0, frequency_deviation=0.1, damping=2e-3, damping_deviation=1e-5, source="a test"
    )
    result = find_damping_interval(2e-3, stuck)
    assert (result.lower, result.upper) == pytest.approx((2e-3 - TWO_SIDED_95 * 1e-5, 2e-3 + TWO_SIDED_95 * 1e-5))


def test_what_the_score_does_not_tell_is_as_wide_as_the_prior() -> None:
    low, high = profile(np.diag([4.0, 1.0, 0.0])).find_ends(2)
    assert high - low == pytest.approx(2 * TWO_SIDED_95 * PRIOR[2], abs=4 * NEAR)


def test_an_independent_error_adds_by_squares_on_either_side() -> None:
    interval = Interval(name="kt", value=100.0, lower=97.0, upper=104.0, source=PROFILE)
    wide = interval.widen(4.0 / TWO_SIDED_95, FREQUENCIES)
    # Sides of 3 and 4, and an error of 4.
    assert (wide.lower, wide.upper) == pytest.approx((95.0, 100.0 + np.sqrt(32.0)))
    assert PROFILE in wide.source
    assert FREQUENCIES in wide.source
    assert interval.widen(200.0, FREQUENCIES).lower == pytest.approx(100.0 - TWO_SIDED_95 * 200.0, rel=1e-3)
    assert interval.widen(200.0, FREQUENCIES, least=0.0).lower == 0.0


def test_the_density_has_twice_the_relative_interval_of_the_free_resonance() -> None:
    free = MeasuredResonance(
        free=True, frequency=120.0, frequency_deviation=0.12, damping=2e-3, damping_deviation=1e-4, source="a test"
    )
    result = find_density_interval(7800.0, free)
    assert result.source == LEAST_SQUARES
    assert result.upper - result.value == pytest.approx(TWO_SIDED_95 * 2 * 1e-3 * 7800.0, rel=1e-9)
