"""A second look: by the weights of an effect that is the one it holds, by those of one that is not it does not."""

from dataclasses import replace
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import list_campaign_effects, list_effects
from diagnosis.decision.judgement import Criteria, Judgement, judge, second_look
from diagnosis.decision.rules import worse_than_noise
from diagnosis.decision.verdict import Finding
from diagnosis.fit.arrangement import Added, Arrangement, arrange, weigh_beside
from diagnosis.fit.calibration_parameter import CalibrationParameter, list_calibration_parameters
from diagnosis.fit.refit import baseline_fit, refit
from diagnosis.localisation import localise
from diagnosis.screening import Score, screen
from diagnosis.step import compute_step
from diagnosis.threshold.detection_threshold import compute_linear_thresholds

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


@pytest.fixture(scope="module")
def known(campaign: Any, small: Model, scores: list[Score]) -> Criteria:
    return Criteria(
        catalogue=list_campaign_effects(campaign, small), scores=scores, thresholds=compute_linear_thresholds(scores)
    )


@pytest.fixture(scope="module")
def first(arrangement: Arrangement, scores: list[Score], known: Criteria) -> Judgement:
    refits = [refit(arrangement, score) for score in scores]
    return judge(arrangement, baseline_fit(arrangement), refits, localise(arrangement), known, compute_step)


def doubted(first: Judgement) -> Judgement:
    return replace(first, verdict=replace(first.verdict, finding=Finding.UNKNOWN, effects=()))


def test_a_fit_is_worse_than_noise_only_without_what_is_hidden(first: Judgement, arrangement: Arrangement) -> None:
    best = first.refits[0]
    assert worse_than_noise(arrangement)
    assert not worse_than_noise(replace(arrangement, fit=best.fit))


def test_weights_beside_an_effect_are_those_of_an_arrangement_that_has_it(
    campaign: Any, small: Model, free: tuple[CalibrationParameter, ...], first: Judgement
) -> None:
    best = first.refits[0]
    assert best.effect is not None
    listed = partial(list_campaign_effects, campaign)
    found = weigh_beside(campaign, first.arrangement, best.effect, best.fit, listed)
    added = Added(effect=best.effect, values=best.fit.values[-1:])
    other = arrange(campaign, small, free, BUDGET, added=[added], catalogue_of=listed)
    assert found.fit.values.shape == first.arrangement.fit.values.shape
    # One is weighed at the fit by the first weights, the other at its own: a small part of what noise there is.
    ratio = found.train.whitening.deviation / other.train.whitening.deviation
    assert np.median(abs(ratio - 1)) < 0.02
    moved = found.train.whitening.deviation / first.arrangement.train.whitening.deviation
    assert np.median(abs(moved - 1)) > 2 * np.median(abs(ratio - 1))


def test_what_is_hidden_holds_by_its_own_weights(campaign: Any, first: Judgement, known: Criteria) -> None:
    told: list[str] = []
    listed = partial(list_campaign_effects, campaign)
    found = second_look(campaign, doubted(first), known, listed, compute_step, told.append)
    assert (found.verdict.finding, found.weighed) == (Finding.MISSING, TRUE)
    assert [each.name for each in found.verdict.effects] == [TRUE]
    assert found.verdict.effects[0].strength == pytest.approx(MASS, abs=3 * found.verdict.effects[0].deviation)
    assert told[0] == f"weights beside {TRUE}"


def test_what_is_not_hidden_does_not_hold_by_its_own_weights(campaign: Any, first: Judgement, known: Criteria) -> None:
    alone = doubted(replace(first, refits=tuple(each for each in first.refits if each.name == FALSE)))
    told: list[str] = []
    assert (
        second_look(campaign, alone, known, partial(list_campaign_effects, campaign), compute_step, told.append)
        is alone
    )
    assert told == [f"weights beside {FALSE}"]  # it was asked, since it passes as long as nothing else does
