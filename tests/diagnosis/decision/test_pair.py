"""Two effects are found together where both are hidden, and one alone where the other stood in for it."""

from functools import partial
from types import ModuleType

import pytest

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import Catalogue, list_campaign_effects
from diagnosis.decision.evidence import compute_log_density
from diagnosis.decision.pair import Pair, fit_pair, fit_seconds
from diagnosis.decision.residual_explanation import add_effect, explain_residual
from diagnosis.fit.arrangement import arrange
from diagnosis.fit.calibration import MIN_GAIN
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.finalist import Finalist, refit_by_own_covariance
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import make_baseline_refit, refit
from diagnosis.screening import screen

#: A mass [kg] and a gain [-] that are hidden, and what changes the readings somewhat like the mass.
MASS, GAIN, OTHER = "mass at tip z", "gain of tip", "spring at tip z"
HIDDEN = {MASS: 5e-3, GAIN: 0.9}
#: More than chance gains by any of thirty effects, once in a hundred times.
CHANCE = 20.0


def hide(listed: Catalogue, small: Model, paper: ModuleType, *names: str) -> Campaign:
    truth = small
    for name in names:
        truth = listed.effect(name).apply(truth, [HIDDEN[name]])
    campaign: Campaign = paper.make_campaign(truth, jitter=3e-5, seed=5)
    return campaign


def finalists_of(campaign: Campaign, small: Model, *names: str) -> tuple[Refit, dict[str, Finalist]]:
    """Fit without an effect, and each effect fitted alone by the covariance of its own model."""
    free = list_calibration_parameters(small, deviation={"kn": 0.0, "E": 0.0})
    arrangement = arrange(campaign, small, tuple(free), Budget(frequency=0.0, compliance=0.0, model=1e-3))
    before, listed = make_baseline_refit(arrangement), partial(list_campaign_effects, campaign)
    scores = screen(arrangement, [listed(small).effect(name) for name in names])
    by_own = partial(refit_by_own_covariance, campaign, arrangement, before, listed, arrangement.train)
    return before, {score.effect.name: by_own(refit(arrangement, score)) for score in scores}


def pair_of(campaign: Campaign, small: Model, first: str, further: str, *others: str) -> Pair:
    before, result = finalists_of(campaign, small, first, *others)
    own, effect = result[first], list_campaign_effects(campaign, small).effect(further)
    rest = explain_residual(add_effect(own.arrangement, own.refit), [effect], CHANCE)
    assert rest.refit is not None
    return fit_pair(own.arrangement, before, own.refit, rest.refit, [result[name].refit for name in others])


@pytest.fixture(scope="module")
def pair(listed: Catalogue, small: Model, paper: ModuleType) -> Pair:
    return pair_of(hide(listed, small, paper, MASS, GAIN), small, MASS, GAIN, OTHER)


def test_both_are_found_with_their_strengths_and_each_gains_beside_the_other(pair: Pair) -> None:
    for item in (pair.first.refit, pair.second.refit):
        assert item.strength == pytest.approx(HIDDEN[item.name], abs=3 * item.deviation)
        assert item.gain > CHANCE
        assert item.held_out_gain > 0
    assert pair.first.refit.label == f"{MASS} and {GAIN}"
    assert pair.alone.name == GAIN


def test_both_leave_no_model_error_that_an_unknown_force_would_seem_to_explain(pair: Pair) -> None:
    assert pair.first.arrangement.model_error_size.shape < 0.1 * pair.alone.arrangement.model_error_size.shape
    assert pair.force < CHANCE


def test_what_is_hidden_explains_more_beside_the_further_effect_than_what_is_not(pair: Pair) -> None:
    assert [item.name for item in pair.ranked] == [MASS, OTHER]
    (other,) = pair.alternatives
    assert other.refit.gain < pair.first.refit.gain
    assert compute_log_density(other.refit) < compute_log_density(pair.first.refit)


def test_other_second_effects_are_fitted_with_the_first(
    pair: Pair, listed: Catalogue, small: Model, paper: ModuleType
) -> None:
    """From its strength alone, the second effect ends where it did; another one gains less."""
    campaign = hide(listed, small, paper, MASS, GAIN)
    result = finalists_of(campaign, small, MASS, GAIN, OTHER)[1]
    mass, others = result[MASS], [result[name].refit for name in (GAIN, OTHER)]
    same, again, other = fit_seconds(mass.arrangement, mass.refit, pair, others)
    assert (same.name, again.name, other.name) == (GAIN, GAIN, OTHER)
    # Two quick fits end within `MIN_GAIN` of the minimum, which is sqrt(MIN_GAIN) standard deviations.
    tolerance = MIN_GAIN**0.5 * pair.second.refit.deviation
    assert again.refit.strength == pytest.approx(pair.second.refit.strength, abs=tolerance)
    assert again.refit.gain == pytest.approx(pair.second.refit.gain, abs=MIN_GAIN)
    assert other.refit.gain < again.refit.gain - CHANCE
    assert compute_log_density(other.refit) < compute_log_density(again.refit) - CHANCE


def test_an_effect_that_stood_in_for_the_further_one_gains_nothing_beside_it(
    listed: Catalogue, small: Model, paper: ModuleType
) -> None:
    pair = pair_of(hide(listed, small, paper, MASS), small, OTHER, MASS)
    assert pair.first.refit.gain < CHANCE
    assert pair.second.refit.gain > CHANCE
    assert pair.alone.refit.strength == pytest.approx(HIDDEN[MASS], abs=3 * pair.alone.refit.deviation)
