"""An effect where no place is: found if what the places offer explains less, and otherwise left alone."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import Catalogue, list_campaign_effects
from diagnosis.decision.rules import Criteria
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.finalist import Finalist, refit_by_own_covariance
from diagnosis.fit.refit import make_baseline_refit, refit
from diagnosis.screening import screen
from diagnosis.step import compute_step
from diagnosis.threshold.detection_threshold import compute_linear_thresholds
from diagnosis.unnamed_place import find_better_elsewhere, list_effects_elsewhere

#: Of `heavy_campaign`, where no place is now.
TRUE, MASS = "mass at node 1 z", 5e-3


@pytest.fixture(scope="module")
def arrangement(small: Model, heavy_campaign: Campaign) -> Arrangement:
    """Without the place at which the mass is."""
    lacking = replace(small, places={name: row for name, row in small.places.items() if name != "tip z"})
    accepted = list_calibration_parameters(lacking, deviation={"kn": 0.0, "E": 0.0})
    return arrange(heavy_campaign, lacking, accepted, Budget(frequency=0.0, compliance=0.0))


@pytest.fixture(scope="module")
def catalogue(heavy_campaign: Campaign, arrangement: Arrangement) -> Catalogue:
    return list_campaign_effects(heavy_campaign, arrangement.base)


def find(campaign: Campaign, arrangement: Arrangement, catalogue: Catalogue, known: list[Finalist]) -> tuple[Any, Any]:
    """Effects that are better than known ones."""
    before = make_baseline_refit(arrangement)
    own = partial(refit_by_own_covariance, campaign, arrangement, before, partial(list_campaign_effects, campaign))
    scores = screen(arrangement, catalogue.candidates)
    by = Criteria(
        catalogue=catalogue, scores=scores, thresholds=compute_linear_thresholds(scores), refit_by_own_covariance=own
    )
    verdict: Any = SimpleNamespace(pair=None, laws=(), nearest=None)
    effects, nothing = list_effects_elsewhere(campaign, arrangement), Finalist(refit=before, arrangement=arrangement)
    return find_better_elsewhere(arrangement, effects, nothing, known, verdict, by, compute_step)


def test_effects_act_at_unnamed_places_alone(
    heavy_campaign: Campaign, arrangement: Arrangement, catalogue: Catalogue
) -> None:
    names = [item.name for item in list_effects_elsewhere(heavy_campaign, arrangement)]
    assert TRUE in names
    # The mass of a node moves along z and x: that at "root z" is there already, and is not listed once more.
    assert {name.partition(" at ")[2] for name in names} <= {"node 1 z", "node 0 x", "node 1 x"}
    assert "mass at node 0 x" not in names
    again = replace(arrangement, added=(list_effects_elsewhere(heavy_campaign, arrangement)[0],))
    assert again.added[0].name not in [item.name for item in list_effects_elsewhere(heavy_campaign, again)]
    assert not {*names} & {*catalogue.names}
    without = list_effects_elsewhere(heavy_campaign, arrangement, without={"mass"})
    assert not any(item.kind == "mass" for item in without)
    finer: Any = replace(arrangement, finer=(SimpleNamespace(),))
    assert list_effects_elsewhere(heavy_campaign, finer) == []


def test_the_effect_that_is_there_is_found_with_its_strength(
    heavy_campaign: Campaign, arrangement: Arrangement, catalogue: Catalogue
) -> None:
    scores, better = find(heavy_campaign, arrangement, catalogue, [])
    assert better[0].name == TRUE
    assert TRUE in [score.effect.name for score in scores]
    assert better[0].refit.strength == pytest.approx(MASS, abs=4 * better[0].refit.deviation)


def test_nothing_is_better_than_what_is_true(
    small: Model, heavy_campaign: Campaign, arrangement: Arrangement, catalogue: Catalogue
) -> None:
    whole = replace(arrangement, base=small)
    (score,) = screen(whole, [list_campaign_effects(heavy_campaign, small).effect("mass at tip z")])
    before = make_baseline_refit(whole)
    known = refit_by_own_covariance(
        heavy_campaign, whole, before, partial(list_campaign_effects, heavy_campaign), whole.train, refit(whole, score)
    )
    assert find(heavy_campaign, arrangement, catalogue, [known]) == ([], [])
