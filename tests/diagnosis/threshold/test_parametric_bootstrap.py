"""Intervals of a fit: as wide as campaigns drawn from the model make its values stray, and never narrower."""

from types import ModuleType

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration import Fit, invert_curvature
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.refit import make_baseline_refit
from diagnosis.threshold.parametric_bootstrap import STUDENT_FACTOR, carry_over, widen_intervals
from diagnosis.threshold.simulation import Simulation


@pytest.fixture(scope="module")
def campaign(small: Model, paper: ModuleType) -> Campaign:
    return paper.make_campaign(small, seed=5)


@pytest.fixture(scope="module")
def arrangement(small: Model, campaign: Campaign) -> Arrangement:
    return arrange(campaign, small, list_calibration_parameters(small), Budget(frequency=1e-4, compliance=0.0))


def deviations(fit: Fit, size: float, n: int = 4000) -> np.ndarray:
    """Of a fit that is taken to differences of so many standard deviations."""
    m = len(fit.residual) - len(fit.values)
    return carry_over(fit, size * np.random.default_rng(1).standard_normal((m, n))).deviation


def test_differences_as_large_as_expected_widen_an_interval_for_being_few_alone(arrangement: Arrangement) -> None:
    fit = arrangement.fit
    # A mean of 4000 squares is good to 2.2 %, its root to half of that: 5 of these.
    np.testing.assert_allclose(deviations(fit, 1.0), STUDENT_FACTOR * fit.deviation, rtol=0.06)


def test_differences_three_times_as_large_widen_what_data_and_not_priors_tell(arrangement: Arrangement) -> None:
    fit = arrangement.fit
    p = len(fit.values)
    data, prior = fit.jacobian[:-p], fit.jacobian[-p:]
    shape = invert_curvature(fit.jacobian, fit.unknowns.size)
    expected = STUDENT_FACTOR * np.sqrt(np.diag(shape @ (9 * data.T @ data + prior.T @ prior) @ shape))
    assert (expected > fit.deviation).all()
    np.testing.assert_allclose(deviations(fit, 3.0), expected, rtol=0.06)


def test_smaller_differences_narrow_nothing(arrangement: Arrangement) -> None:
    np.testing.assert_array_equal(deviations(arrangement.fit, 0.1), arrangement.fit.deviation)


def test_correlations_stay_as_they_are(arrangement: Arrangement) -> None:
    fit = arrangement.fit
    wide = carry_over(fit, 3 * np.random.default_rng(2).standard_normal((len(fit.residual) - len(fit.values), 50)))
    before, after = (item.covariance / np.outer(item.deviation, item.deviation) for item in (fit, wide))
    np.testing.assert_allclose(after, before, rtol=1e-12)


def test_values_of_drawn_campaigns_stray_as_the_interval_says(arrangement: Arrangement, campaign: Campaign) -> None:
    before = make_baseline_refit(arrangement)
    fitted = Finalist(refit=before, arrangement=arrangement)
    (wide,) = widen_intervals(campaign, fitted, [fitted])
    np.testing.assert_array_equal(wide.fit.values, before.fit.values)
    assert wide.deviation >= before.deviation
    assert (wide.fit.deviation >= before.fit.deviation).all()
    # Here is little that a linear theory misses; the root of a mean of eight squares is good to a quarter, and five
    # such deviations, with the factor for the few, are out of reach.
    assert (wide.fit.deviation < STUDENT_FACTOR * (1 + 5 / 4) * before.fit.deviation).all()
    (again,) = widen_intervals(campaign, fitted, [fitted])
    np.testing.assert_array_equal(again.fit.covariance, wide.fit.covariance)


def test_what_is_held_out_is_not_read(arrangement: Arrangement, campaign: Campaign) -> None:
    table, held = campaign.measurement, campaign.held_out
    away = np.isin(table.repeat, held.repeats) | np.isin(table.level, held.levels)
    assert away.any()
    whole, part = (
        Simulation(campaign=campaign, arrangement=arrangement, held_out=item).read(np.random.default_rng(1))
        for item in (True, False)
    )
    assert np.isnan(part[away]).all()
    assert np.isfinite(whole[away]).any()
    assert np.isfinite(part[~away]).sum() == np.isfinite(whole[~away]).sum() > 0
