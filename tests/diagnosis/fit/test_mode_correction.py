"""Errors of natural frequencies as parameters: each moves its own frequency, and there is one where it is needed."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import find_sweep_directions, take_training_part
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.fit.arrangement import Arrangement, expect_usual_error
from diagnosis.fit.mode_correction import ModeCorrection, list_mode_corrections
from diagnosis.fit.weighting import Measured, allow_model_error, leave_out_model_error


def frequencies(model: Model) -> np.ndarray:
    return np.sqrt(scipy.linalg.eigh(model.system.stiffness, model.system.mass, eigvals_only=True))


def prepared(campaign: Campaign) -> Measured:
    return Measured.prepare(take_training_part(campaign), find_sweep_directions(campaign))


def test_each_moves_its_own_frequency(heavy_campaign: Campaign, small: Model) -> None:
    *corrections, with_contacts = list_mode_corrections(prepared(heavy_campaign), small, Budget(frequency=0.02))
    assert corrections
    nominal = frequencies(small)
    # That of the structure with its contacts acts in no other test: it is as if the test had been slower.
    shifted = with_contacts.apply(small, [1.001])
    assert shifted.frequency_shift == {"jointed": pytest.approx(1 / 1.001 - 1)}
    np.testing.assert_array_equal(frequencies(shifted), nominal)
    for item in corrections:
        assert isinstance(item, ModeCorrection)
        ratio = frequencies(item.apply(small, [1.001])) / nominal
        # Its square is linear in the factor, which leaves half the square of a thousandth.
        np.testing.assert_allclose(ratio, 1 + 1e-3 * (np.arange(len(ratio)) == item.number), rtol=0, atol=1e-6)


def test_an_error_that_readings_are_linear_in_is_none(heavy_campaign: Campaign, small: Model) -> None:
    measured = prepared(heavy_campaign)
    assert list_mode_corrections(measured, small, Budget(frequency=1e-6)) == ()
    assert list_mode_corrections(measured, small, Budget(frequency=0.0)) == ()


def test_a_finer_model_has_errors_of_its_own(heavy_campaign: Campaign, small: Model) -> None:
    corrections = list_mode_corrections(prepared(heavy_campaign), small, Budget(frequency=0.02))
    for item in (corrections[0], corrections[-1]):
        assert replace(item, n_dof=2).apply(small, [1.01]) is small


def test_model_error_of_its_usual_size_hides_no_mass(heavy: Arrangement) -> None:
    usual = expect_usual_error(replace(heavy, budget=replace(heavy.budget, model=1e-3)))
    assert usual.model_error_size.reading == 1e-3
    # The mass is far beyond an error of 0.1 %.
    assert usual.fit.chi2 > 2 * usual.fit.n_number


def test_what_is_beyond_stated_errors_shows_again(heavy: Arrangement) -> None:
    train, fit = heavy.train, heavy.fit
    wide = allow_model_error(train, fit.model, fit.prediction, 1e-3, replace(heavy.model_error_size, reading=0.1))
    assert np.linalg.norm(wide.residual(fit.prediction)) < 0.5 * np.linalg.norm(train.residual(fit.prediction))
    again = leave_out_model_error(wide).residual(fit.prediction)
    np.testing.assert_array_equal(again, train.residual(fit.prediction))
    assert leave_out_model_error(train) is train
