"""A finer model is calibrated before it is compared: what is left is what no calibration makes good."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.measurement import Campaign
from correlation.nuisance import Budget
from correlation.test_model import TestModel
from diagnosis.accepted import accepted
from diagnosis.arrangement import Added, Arrangement, arrange
from diagnosis.calibration import calibrate
from diagnosis.catalogue import Catalogue
from diagnosis.simulation import Simulation
from diagnosis.unknowns import Unknowns

#: The finer model is stiffer by this: its resonance is off by a width.
STIFFER = 0.01
#: Of what matters; a calibration ends when a step would gain 0.3 of chi^2.
FOUND = 0.1


@pytest.fixture(scope="module")
def campaign(small: TestModel, paper: ModuleType) -> Campaign:
    return paper.make_campaign(small, jitter=3e-5, seed=6)


def stiffer(model: TestModel) -> TestModel:
    (young,) = (each for each in accepted(model) if each.name == "E")
    return young.apply(model, [1 + STIFFER])


def beside(campaign: Campaign, small: TestModel, finer: TestModel, added: tuple[Added, ...] = ()) -> Arrangement:
    budget = Budget(frequency=0.0, compliance=0.0, shares=0.0, refined=(finer,))
    return arrange(campaign, small, accepted(small, deviation={"kn": 0.0}), budget, added=added)


def left(of: Arrangement) -> NDArray[np.float64]:
    """What the finer model says beside the model, in standard deviations of the measurements' noise."""
    said = of.train.predict(of.finer[0].compose(of.fit.values), of.fit.prediction)
    features = of.train.features
    change = features.of_values(said.value) - features.of_values(of.fit.prediction.value)
    return change / of.train.whitening.deviation


def test_what_calibration_makes_good_is_no_error_but_an_uncertainty(small: TestModel, campaign: Campaign) -> None:
    found = beside(campaign, small, stiffer(small))
    names = [each.name for each in found.accepted]
    young = names.index("E")
    shift = found.finer[0].shift
    assert shift is not None
    # The model's E is near 1, and the finer one's is by so much less.
    assert shift[young] == pytest.approx(-STIFFER * found.fit.values[young], rel=FOUND)
    plain = replace(found.finer[0], shift=None)
    assert np.linalg.norm(left(found)) < FOUND * np.linalg.norm(left(replace(found, finer=(plain,))))
    # E is not known better than two meshes that differ in nothing else say.
    assert found.fit.deviation[young] >= STIFFER * (1 - FOUND)
    alone = arrange(campaign, small, found.accepted, Budget(frequency=0.0, compliance=0.0, shares=0.0))
    assert alone.fit.deviation[young] < STIFFER / 3


def test_what_no_calibration_makes_good_stays(small: TestModel, campaign: Campaign, listed: Catalogue) -> None:
    heavier = listed.effect("mass at tip z").apply(small, [5e-3])
    found = beside(campaign, small, heavier)
    plain = replace(found.finer[0], shift=None)
    apart, before = (np.linalg.norm(left(each)) for each in (found, replace(found, finer=(plain,))))
    assert 3 < apart < before


def test_an_added_effect_keeps_its_value_in_the_finer_model(
    small: TestModel, heavy_campaign: Campaign, listed: Catalogue
) -> None:
    mass = listed.effect("mass at tip z")
    found = beside(heavy_campaign, small, stiffer(small), (Added(effect=mass, values=np.array([5e-3])),))
    shift = found.finer[0].shift
    assert shift is not None
    assert len(shift) == len(found.accepted) == len(found.fit.values) - 1
    composed = found.finer[0].compose(found.fit.values)
    by_hand = Unknowns(base=stiffer(small), effects=found.fit.unknowns.effects, prior=found.fit.unknowns.prior)
    expected = by_hand.compose(found.fit.values + np.append(shift, 0.0))
    np.testing.assert_allclose(composed.system.mass, expected.system.mass, rtol=1e-12)
    np.testing.assert_allclose(composed.system.stiffness, expected.system.stiffness, rtol=1e-12)


def test_it_is_calibrated_once(small: TestModel, campaign: Campaign) -> None:
    found = beside(campaign, small, stiffer(small))
    assert found.finer[0].calibrated(found.train, found.fit) is found.finer[0]


def test_an_effect_that_is_tried_is_no_numerical_error(
    small: TestModel, heavy_campaign: Campaign, listed: Catalogue
) -> None:
    alike, mass = beside(heavy_campaign, small, small), listed.effect("mass at tip z")
    fit = calibrate(alike.train, alike.unknowns([mass]), np.array([*alike.fit.values, 5e-3]), alike.fit.prediction)
    simulation = Simulation(campaign=heavy_campaign, arrangement=replace(alike, fit=fit), held_out=False)
    (change,) = simulation._finer_changes()
    # A finer mesh that changes nothing; the mass moves numbers by some ten standard deviations each.
    assert np.abs(change / alike.train.whitening.deviation).max() < FOUND
    moved = fit.residual[: len(change)] - alike.train.residual(alike.fit.prediction)
    assert np.abs(moved).max() > 3
