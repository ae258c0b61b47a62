"""A finer model is calibrated before it is compared: what is left is what no calibration makes good."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.arrangement import Arrangement, arrange, arrange_anew
from diagnosis.fit.calibration import calibrate
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.finer_model import widen_by_finer_models
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.refit import make_baseline_refit, refit
from diagnosis.screening import screen
from diagnosis.threshold.parametric_bootstrap import widen_intervals
from diagnosis.threshold.simulation import Simulation
from tests.slow import slow

#: The finer model is stiffer by this: its resonance is off by a width.
STIFFER = 0.01
#: Of what matters; a calibration ends when a step would gain 0.3 of chi^2.
FOUND = 0.1


@pytest.fixture(scope="module")
def campaign(small: Model, paper: ModuleType) -> Campaign:
    return paper.make_campaign(small, jitter=3e-5, seed=6)


def stiffer(model: Model) -> Model:
    (young,) = (item for item in list_calibration_parameters(model) if item.name == "E")
    return young.apply(model, [1 + STIFFER])


def beside(campaign: Campaign, small: Model, finer: Model, added: tuple[AddedEffect, ...] = ()) -> Arrangement:
    budget = Budget(frequency=0.0, compliance=0.0, shares=0.0, refined=(finer,))
    return arrange(campaign, small, list_calibration_parameters(small, deviation={"kn": 0.0}), budget, added=added)


@pytest.fixture(scope="module")
def beside_stiffer(campaign: Campaign, small: Model) -> Arrangement:
    """Beside a finer model that is stiffer and nothing else."""
    return beside(campaign, small, stiffer(small))


def left(of: Arrangement) -> NDArray[np.float64]:
    """What the finer model says beside the model, in standard deviations of the measurements' noise."""
    said = of.train.predict(of.finer[0].compose(of.fit.values), of.fit.prediction)
    features = of.train.features
    change = features.of_values(said.value) - features.of_values(of.fit.prediction.value)
    return change / of.train.whitening.deviation


def test_what_calibration_makes_good_is_no_error_but_an_uncertainty(
    beside_stiffer: Arrangement, campaign: Campaign, listed: Catalogue
) -> None:
    result = beside_stiffer
    names = [item.name for item in result.calibration]
    young = names.index("E")
    shift = result.finer[0].shift
    assert shift is not None
    # The model's E is near 1, and the finer one's is by so much less.
    assert shift[young] == pytest.approx(-STIFFER * result.fit.values[young], rel=FOUND)
    plain = replace(result.finer[0], shift=None)
    assert np.linalg.norm(left(result)) < FOUND * np.linalg.norm(left(replace(result, finer=(plain,))))
    # E is not known better than two meshes that differ in nothing else say, with an effect or without.
    effect = listed.effect("mass at tip z")
    with_mass = calibrate(
        result.train, result.unknowns([effect]), np.append(result.fit.values, 0.0), result.fit.prediction
    )
    for fit in (result.fit, with_mass):
        assert fit.deviation[young] < STIFFER / 3
        assert widen_by_finer_models(fit, result.finer).deviation[young] >= STIFFER * (1 - FOUND)
    before, (refitted,) = (
        make_baseline_refit(result),
        [refit(result, score, with_mass) for score in screen(result, [effect])],
    )
    fits = [Finalist(refit=item, arrangement=result) for item in (before, refitted)]
    for item in widen_intervals(campaign, fits[0], fits):
        assert item.fit.deviation[young] >= STIFFER * (1 - FOUND)


def test_what_no_calibration_makes_good_stays(small: Model, campaign: Campaign, listed: Catalogue) -> None:
    heavier = listed.effect("mass at tip z").apply(small, [5e-3])
    result = beside(campaign, small, heavier)
    plain = replace(result.finer[0], shift=None)
    apart, before = (np.linalg.norm(left(item)) for item in (result, replace(result, finer=(plain,))))
    assert 3 < apart < before


def test_an_added_effect_keeps_its_value_in_the_finer_model(
    small: Model, heavy_campaign: Campaign, listed: Catalogue
) -> None:
    mass = listed.effect("mass at tip z")
    result = beside(heavy_campaign, small, stiffer(small), (AddedEffect(effect=mass, values=np.array([5e-3])),))
    shift = result.finer[0].shift
    assert shift is not None
    assert len(shift) == len(result.calibration) == len(result.fit.values) - 1
    composed = result.finer[0].compose(result.fit.values)
    by_hand = Unknowns(base=stiffer(small), effects=result.fit.unknowns.effects, prior=result.fit.unknowns.prior)
    expected = by_hand.compose(result.fit.values + np.append(shift, 0.0))
    np.testing.assert_allclose(composed.system.mass, expected.system.mass, rtol=1e-12)
    np.testing.assert_allclose(composed.system.stiffness, expected.system.stiffness, rtol=1e-12)


def test_other_measurements_do_not_move_it(beside_stiffer: Arrangement, small: Model, paper: ModuleType) -> None:
    result = beside_stiffer
    anew = arrange_anew(result, paper.make_campaign(small, jitter=3e-5, seed=7))
    assert anew.finer[0].shift is result.finer[0].shift
    assert (anew.fit.values != result.fit.values).any()


@pytest.mark.parametrize("effect", ["dashpot at root z", pytest.param("mass at tip z", marks=slow)])
def test_a_finer_model_that_is_the_model_needs_no_shift(
    effect: str, small: Model, paper: ModuleType, listed: Catalogue
) -> None:
    # Damping that was calibrated does not scale a dashpot that was added.
    added = listed.effect(effect)
    strength = added.parameters[0].typical
    (zeta,) = (item for item in list_calibration_parameters(small) if item.name == "zeta")
    truth = added.apply(zeta.apply(small, [1.5]), [strength])
    of = paper.make_campaign(truth, jitter=3e-5, seed=8)
    result = beside(of, small, small, (AddedEffect(effect=added, values=np.array([strength])),))
    assert result.fit.values[[item.name for item in result.calibration].index("zeta")] > 1.3
    np.testing.assert_allclose(result.finer[0].shift, 0, atol=1e-6)


def test_states_that_the_model_does_not_find_say_nothing(small: Model, campaign: Campaign) -> None:
    result = beside(campaign, small, small)
    value = result.fit.prediction.value.copy()
    value[result.train.observed.points.level == result.train.observed.points.level.min()] = np.nan
    unfound = replace(result.fit, prediction=replace(result.fit.prediction, value=value))
    elsewhere = replace(result.train, measured=1.05 * result.train.measured)
    shift = result.finer[0].calibrated(elsewhere, unfound).shift
    assert shift is not None
    # A thousandth of the weight, squared, of what was measured 5 % off.
    np.testing.assert_allclose(shift, 0, atol=1e-5)


@slow
def test_of_several_finer_models_each_counts(small: Model, campaign: Campaign) -> None:
    budget = Budget(frequency=0.0, compliance=0.0, shares=0.0, refined=(stiffer(small), stiffer(small)))
    result = arrange(campaign, small, list_calibration_parameters(small, deviation={"kn": 0.0}), budget)
    young = [item.name for item in result.calibration].index("E")
    assert widen_by_finer_models(result.fit, result.finer).deviation[young] == pytest.approx(
        np.sqrt(2) * STIFFER, rel=FOUND
    )


def test_without_accepted_parameters_the_difference_is_what_it_is(
    small: Model, heavy_campaign: Campaign, listed: Catalogue
) -> None:
    mass = AddedEffect(effect=listed.effect("mass at tip z"), values=np.array([5e-3]))
    budget = Budget(frequency=0.0, compliance=0.0, shares=0.0, refined=(stiffer(small),))
    result = arrange(heavy_campaign, small, (), budget, added=(mass,))
    assert result.finer[0].shift is not None
    assert len(result.finer[0].shift) == 0
    assert result.fit.values == pytest.approx([5e-3], rel=0.1)


def test_an_effect_that_is_tried_is_no_numerical_error(
    small: Model, heavy_campaign: Campaign, listed: Catalogue
) -> None:
    alike, mass = beside(heavy_campaign, small, small), listed.effect("mass at tip z")
    fit = calibrate(alike.train, alike.unknowns([mass]), np.array([*alike.fit.values, 5e-3]), alike.fit.prediction)
    simulation = Simulation(campaign=heavy_campaign, arrangement=replace(alike, fit=fit), held_out=False)
    (change,) = simulation._refinement_changes()
    # A finer mesh that changes nothing; the mass moves numbers by some ten standard deviations each.
    assert np.abs(change / alike.train.whitening.deviation).max() < FOUND
    moved = fit.residual[: len(change)] - alike.train.residual(alike.fit.prediction)
    assert np.abs(moved).max() > 3
