"""Intervals of calibrated parameters: those of a quadratic score are known in closed form."""

import numpy as np
import pytest

from correlation.uncertainty.interval import TWO_SIDED_95
from study.estimate.resonance import MeasuredResonance
from study.paper.fit import PRIOR, compute_prior
from study.paper.interval import LEAST_SQUARES, explore, find_density_interval, fit_surface
from study.paper.parameters import RigParameters

HESSIAN = np.array([[4.0, 1.5, 0.0], [1.5, 1.0, 0.1], [0.0, 0.1, 0.3]])
MINIMUM = np.array([0.4, -0.3, 1.0])


def score(scaled: np.ndarray, hessian: np.ndarray = HESSIAN) -> float:
    away = scaled - MINIMUM
    return float(away @ hessian @ away / 2) + 7.0


def explored(hessian: np.ndarray, here: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    tried, found = [here], [score(here, hessian)]

    def look(scaled: np.ndarray) -> float:
        tried.append(scaled)
        found.append(score(scaled, hessian))
        return found[-1] + compute_prior(scaled)

    explore(look, here, found[0] + compute_prior(here))
    return fit_surface(np.array(tried), np.array(found), here)


def test_a_quadratic_score_gives_the_profile_interval_in_closed_form() -> None:
    centre, covariance = explored(HESSIAN, MINIMUM)
    whole = HESSIAN + np.eye(3) / PRIOR**2
    # A least-squares fit of a surface to itself: round-off.
    np.testing.assert_allclose(covariance, np.linalg.inv(whole), rtol=1e-8)
    np.testing.assert_allclose(centre, np.linalg.solve(whole, HESSIAN @ MINIMUM), rtol=1e-8)


def test_at_the_end_of_an_interval_the_profile_has_risen_by_its_quantile() -> None:
    centre, covariance = explored(HESSIAN, MINIMUM)
    half = TWO_SIDED_95 * np.sqrt(covariance[0, 0])
    # The others at their best where the first is held.
    others = centre[1:] + covariance[1:, 0] / covariance[0, 0] * half
    end = np.array([centre[0] + half, *others])
    rise = score(end) + compute_prior(end) - score(centre) - compute_prior(centre)
    assert rise == pytest.approx(TWO_SIDED_95**2 / 2, rel=1e-6)


def test_what_the_score_does_not_tell_is_as_wide_as_the_prior() -> None:
    flat = np.diag([4.0, 1.0, 0.0])
    _, covariance = explored(flat, MINIMUM)
    assert covariance[2, 2] == pytest.approx(PRIOR**2, rel=1e-6)


def test_the_density_has_twice_the_relative_interval_of_the_free_resonance() -> None:
    free = MeasuredResonance(
        free=True, frequency=120.0, frequency_deviation=0.12, damping=2e-3, damping_deviation=1e-4, source="a test"
    )
    parameters = RigParameters(kt=1.0, kn=1.0, mu=0.5, damping=2e-3, density=7800.0)
    (found,) = find_density_interval(parameters, free)
    assert found.source == LEAST_SQUARES
    assert found.upper - found.value == pytest.approx(TWO_SIDED_95 * 2 * 1e-3 * 7800.0, rel=1e-9)
    assert list(find_density_interval(parameters, None)) == []
