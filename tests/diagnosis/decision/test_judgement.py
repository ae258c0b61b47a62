"""Finalists are judged by their own covariance: what is hidden holds, and what is not does not."""

from dataclasses import replace
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import list_campaign_effects, list_effects
from diagnosis.decision.evidence import passes
from diagnosis.decision.rules import Criteria, judge
from diagnosis.decision.verdict import Finding
from diagnosis.fit import finalist
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration import MIN_GAIN
from diagnosis.fit.calibration_parameter import CalibrationParameter, list_calibration_parameters
from diagnosis.fit.finalist import Finalist, refit_by_own_covariance, refit_each_by_own_covariance
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import make_baseline_refit, refit
from diagnosis.fit.weighting import leave_out_model_error
from diagnosis.model_error_share import rank_by_best_covariance
from diagnosis.screening import Score, screen
from diagnosis.step import compute_step
from diagnosis.threshold.detection_threshold import Thresholds, compute_linear_thresholds
from diagnosis.unknown_force import find_unknown_forces
from tests.slow import slow

BUDGET = Budget(frequency=0.0, compliance=0.0)
MASS, TRUE, FALSE = 5e-3, "mass at tip z", "spring at tip z"  # kg, of 0.8


@pytest.fixture(scope="module")
def campaign(small: Model, paper: ModuleType) -> Any:
    truth = list_effects(small, level=paper.LEVELS[1]).effect(TRUE).apply(small, [MASS])
    return paper.make_campaign(truth, jitter=3e-5, seed=5)


@pytest.fixture(scope="module")
def free(small: Model) -> tuple[CalibrationParameter, ...]:
    return tuple(list_calibration_parameters(small, deviation={"kn": 0.0, "E": 0.0}))


@pytest.fixture(scope="module")
def arrangement(campaign: Any, small: Model, free: tuple[CalibrationParameter, ...]) -> Arrangement:
    return arrange(campaign, small, free, BUDGET)


@pytest.fixture(scope="module")
def scores(campaign: Any, small: Model, arrangement: Arrangement) -> list[Score]:
    listed = list_campaign_effects(campaign, small)
    return screen(arrangement, [listed.effect(name) for name in (TRUE, FALSE)])


def make_refit_of_quick_fit(campaign: Any, arrangement: Arrangement, before: Refit) -> "partial[Finalist]":
    """Fits an effect to the end from its quick fit."""
    listed = partial(list_campaign_effects, campaign)
    return partial(refit_by_own_covariance, campaign, arrangement, before, listed, arrangement.train)


def weighed(campaign: Any, arrangement: Arrangement, before: Refit, refits: list[Refit]) -> list[Finalist]:
    return refit_each_by_own_covariance(arrangement, refits, make_refit_of_quick_fit(campaign, arrangement, before))


@pytest.fixture(scope="module")
def finalists(campaign: Any, arrangement: Arrangement, scores: list[Score]) -> list[Finalist]:
    refits = [refit(arrangement, score) for score in scores]
    before = make_baseline_refit(arrangement)
    return weighed(campaign, arrangement, before, refits)


def test_an_effect_that_gains_no_more_than_chance_is_weighed_by_the_common_covariance_alone(
    campaign: Any, small: Model, arrangement: Arrangement, scores: list[Score]
) -> None:
    own = make_refit_of_quick_fit(campaign, arrangement, make_baseline_refit(arrangement))
    (score,) = [item for item in scores if item.effect.name == FALSE]
    false = refit(arrangement, score)
    both, alone = own(false), own(false, chance=np.inf)
    # The gain is the smaller one of those by both.
    assert alone.refit.gain == arrangement.cost - alone.arrangement.cost >= both.refit.gain
    assert own(false, chance=alone.refit.gain - 1e-6).refit.gain == both.refit.gain


@pytest.mark.parametrize("covariance", ["common", "own"])
def test_a_fit_that_is_worse_than_the_one_without_its_effect_is_started_again_from_there(
    covariance: str, campaign: Any, small: Model, arrangement: Arrangement, scores: list[Score],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """A model with an effect contains the one without, so that no minimum with it is worse."""
    own = make_refit_of_quick_fit(campaign, arrangement, make_baseline_refit(arrangement))
    (score,) = [item for item in scores if item.effect.name == TRUE]
    true = refit(arrangement, score)
    usual = own(true).refit
    place, name = {"common": (Arrangement, "with_refit"), "own": (finalist, "arrange_with_effect")}[covariance]
    find, missed = getattr(place, name), list[Arrangement]()

    def miss(*given: Any) -> Arrangement:
        right: Arrangement = find(*given)
        if missed:
            return right
        missed.append(right.with_fit(right.train, replace(right.fit, chi2=right.fit.chi2 + 1e6)))
        return missed[0]

    monkeypatch.setattr(place, name, miss)
    again = own(true).refit
    assert missed
    assert again.gain == pytest.approx(usual.gain, abs=2 * MIN_GAIN)  # where each of two fits may stop
    assert again.strength == pytest.approx(usual.strength, abs=usual.deviation)


def test_a_finalist_has_the_covariance_of_an_arrangement_that_has_its_effect(
    campaign: Any, small: Model, free: tuple[CalibrationParameter, ...], arrangement: Arrangement,
    finalists: list[Finalist],
) -> None:  # fmt: skip
    result = next(item for item in finalists if item.name == TRUE)
    assert result.refit.effect is not None
    added = AddedEffect(effect=result.refit.effect, values=result.refit.fit.values[-1:])
    listed = partial(list_campaign_effects, campaign)
    other = arrange(campaign, small, free, BUDGET, added=[added], catalogue_of=listed)
    # One is weighed at the fit by the first covariance, the other at its own: a small part of what noise there is.
    ratio = result.arrangement.train.whitening.deviation / other.train.whitening.deviation
    assert np.median(abs(ratio - 1)) < 0.02
    moved = result.arrangement.train.whitening.deviation / arrangement.train.whitening.deviation
    assert np.median(abs(moved - 1)) > 2 * np.median(abs(ratio - 1))


def test_what_is_hidden_is_named_with_its_strength(
    campaign: Any, small: Model, arrangement: Arrangement, scores: list[Score], finalists: list[Finalist]
) -> None:
    criteria = Criteria(
        catalogue=list_campaign_effects(campaign, small), scores=scores, thresholds=compute_linear_thresholds(scores)
    )
    before = Finalist(refit=make_baseline_refit(arrangement), arrangement=arrangement)
    ranked, verdict = judge(before, finalists, find_unknown_forces(arrangement), criteria, compute_step)
    assert verdict.finding is Finding.MISSING
    assert [item.name for item in verdict.effects] == [TRUE] == [ranked[0].name]
    assert verdict.effects[0].strength == pytest.approx(MASS, abs=3 * verdict.effects[0].deviation)
    # The other is so far behind that its own covariance does not matter.
    assert len(finalists) == 1


def test_what_explains_alone_what_a_stand_in_and_it_do_together_is_judged_as_well(
    campaign: Any, small: Model, arrangement: Arrangement, scores: list[Score]
) -> None:
    """The true effect is among the candidates, but was not fitted to the end."""
    by_name = {score.effect.name: score for score in scores}
    before = make_baseline_refit(arrangement)
    stand_in = weighed(campaign, arrangement, before, [refit(arrangement, by_name[FALSE])])
    own = partial(refit_by_own_covariance, campaign, arrangement, before, partial(list_campaign_effects, campaign))
    listed = list_campaign_effects(campaign, small)
    criteria = Criteria(
        catalogue=listed, scores=scores, thresholds=compute_linear_thresholds(scores),
        refit_by_own_covariance=own,
    )  # fmt: skip
    nothing, places = Finalist(refit=before, arrangement=arrangement), find_unknown_forces(arrangement)
    ranked, verdict = judge(nothing, stand_in, places, criteria, compute_step)
    assert verdict.finding is Finding.MISSING
    assert [item.name for item in verdict.effects] == [TRUE]
    assert [item.name for item in ranked] == [TRUE, FALSE]
    # Without a way to fit it to the end it is told as something that the stand-in leaves.
    unable = judge(nothing, stand_in, places, replace(criteria, refit_by_own_covariance=None), compute_step)[1]
    assert unable.finding is Finding.UNKNOWN
    assert unable.instead is not None
    assert unable.instead.name == TRUE


def test_an_effect_that_makes_the_held_out_error_larger_is_not_named(
    campaign: Any, arrangement: Arrangement, scores: list[Score], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The limit is set below what any effect reaches: chi^2 falls all the same."""
    monkeypatch.setattr(finalist, "MAX_CHI2_RISE", 1e-9)
    refits = [refit(arrangement, scores[0])]
    before = make_baseline_refit(arrangement)
    (result,) = weighed(campaign, arrangement, before, refits)
    assert result.refit.gain > 10
    assert result.refit.worsens
    assert not passes(result.refit, Thresholds(gain=1.0, misfit=1.0))


@slow
def test_an_effect_leaves_less_model_error(
    campaign: Any, small: Model, free: tuple[CalibrationParameter, ...], scores: list[Score]
) -> None:
    """A model without the mass has errors of frequencies and readings in its place, and one with it smaller ones."""
    without = arrange(campaign, small, free, Budget(frequency=0.0, compliance=0.0, model=1e-3))
    true = next(score for score in scores if score.effect.name == TRUE)
    before, first = make_baseline_refit(without), refit(without, true)
    (result,) = weighed(campaign, without, before, [first])
    deviation_factor = [item.train.deviation_factor for item in (without, result.arrangement)]
    np.testing.assert_array_equal(*deviation_factor)
    assert result.arrangement.model_error_size.frequency < 0.2 * without.model_error_size.frequency
    assert result.arrangement.model_error_size.shape < 0.5 * without.model_error_size.shape
    # By the covariance with this error the mass seems to gain less than with a model error that suits it.
    (seen,) = screen(without, [true.effect])
    (suited,) = rank_by_best_covariance(without, [seen])
    assert suited.gain > 1.2 * seen.gain
    assert without.cost_with_error_left(first.fit) < without.cost - result.refit.gain / 2
    # Model error takes up what is missing: less is gained than by the covariance of noise alone, but as clearly.
    plain = leave_out_model_error(without.train)
    left = [float(np.sum(plain.residual(item.fit.prediction) ** 2)) for item in (before, first)]
    assert 50 < result.refit.gain < left[0] - left[1]


@pytest.mark.parametrize(
    ("misfit", "error", "worse"),
    [
        ((2.0, 2.1), (0.1, 0.1), False),
        ((2.0, 2.3), (0.1, 0.05), True),  # a tenth
        ((0.3, 0.9), (0.1, 0.1), False),  # noise explains both
        ((9.0, 3.0), (0.1, 0.14), False),
        ((9.0, 3.0), (0.1, 0.16), True),  # half as much again
        ((9.0, 1.0), (0.1, 0.16), False),  # a peak that moved with the jitter
    ],
)
def test_held_out_data_are_worse_by_their_misfit_or_by_a_much_larger_error(
    arrangement: Arrangement, misfit: tuple[float, float], error: tuple[float, float], worse: bool
) -> None:
    without, refit = (
        replace(make_baseline_refit(arrangement), held_out_reduced_chi2_without_model_error=chi2, held_out_error=size)
        for chi2, size in zip(misfit, error, strict=True)
    )
    assert finalist.is_worse(refit, without) is worse


def test_the_density_of_held_out_data_has_their_jitter_integrated_out(finalists: list[Finalist]) -> None:
    """Laplace's approximation is exact where readings are linear in the jitter: the covariance has it then."""
    result = next(item for item in finalists if item.name == TRUE)
    whole, fit = result.arrangement.held_out, result.arrangement.fit
    residual = whole.residual(whole.predictor.predict(fit.model, fit.prediction))
    exact = float(residual @ residual) + whole.whitening.log_determinant
    # The covariance has the slopes of the readings at the fit, where a fit of the jitter follows their curvature.
    assert result.arrangement.tested(None, fit).held_out_cost == pytest.approx(exact, abs=1.0)
