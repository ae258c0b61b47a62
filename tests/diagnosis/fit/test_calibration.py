"""Calibration finds planted parameters within the errors that it states, and stops at a bound."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut
from correlation.errors import CampaignError
from correlation.model import Model
from correlation.noise.nuisance import Budget
from correlation.prediction import Prediction
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration import MIN_GAIN, Ending, Fit, Search, calibrate, recalibrate
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.comparison import NOT_FOUND, Comparison
from diagnosis.fit.fit_parameter import Unknowns
from hbsolve.errors import ModelError

PLANTED = {"kt": 1.06, "mu": 0.93, "zeta": 1.1}
EXACT_MODEL = Budget(frequency=0.0, compliance=0.0)
JITTER = 1e-4


def planted(model: Model, factors: dict[str, float]) -> Model:
    for item in list_calibration_parameters(model):
        if item.name in factors:
            model = item.apply(model, [factors[item.name]])
    return model


@pytest.fixture(scope="module")
def campaign(small: Model, paper: ModuleType) -> Campaign:
    return paper.make_campaign(planted(small, PLANTED), jitter=JITTER, seed=11)


@pytest.fixture(scope="module")
def arranged(small: Model, campaign: Campaign) -> Arrangement:
    return arrange(campaign, small, list_calibration_parameters(small, deviation={"kn": 0.0, "E": 0.0}), EXACT_MODEL)


def test_planted_parameters_come_back_within_their_errors(arranged: Arrangement) -> None:
    fit = arranged.fit
    assert fit.unknowns.names == tuple(PLANTED)
    away = (fit.values - np.array(list(PLANTED.values()))) / fit.deviation
    # Normal: 4 standard deviations once in 16 000. The errors are small enough for the test to mean something.
    assert (np.abs(away) < 4).all()
    assert (fit.deviation < 0.02).all()


def test_the_fit_is_as_good_as_the_noise(arranged: Arrangement) -> None:
    fit = arranged.fit
    # chi-square of some 170 numbers is within 4.5 sqrt(2 / 170) = 0.5 of 1; priors add little. The history modes and
    # errors estimated from four repeats lower it.
    assert 0.3 < fit.chi2 / fit.n_number < 1.5
    settled = calibrate(
        arranged.held_out_without_jitter,
        u := Unknowns.from_effects(fit.model, arranged.jitter, ()),
        u.vanishing,
        fit.prediction,
    )
    assert 0.3 < settled.chi2 / settled.n_number < 1.6


def test_a_fit_goes_on_from_its_own_prediction(arranged: Arrangement, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = calibrate(arranged.train, arranged.fit.unknowns, arranged.fit.unknowns.vanishing, ending=Ending.QUICK)
    made: list[Model] = []
    predict = Comparison.predict

    def count(comparison: Comparison, model: Model, *rest: Any) -> Prediction:
        made.append(model)
        return predict(comparison, model, *rest)

    monkeypatch.setattr(Comparison, "predict", count)
    anew = calibrate(arranged.train, begun.unknowns, begun.values, begun.prediction)
    n_anew = len(made)
    result = recalibrate(arranged.train, begun)
    assert len(made) - n_anew == n_anew - 1
    # Newton's method ends at 1e-9 of the linear motion, and the fit at a gain of `MIN_GAIN`.
    assert result.chi2 == pytest.approx(anew.chi2, abs=MIN_GAIN)
    np.testing.assert_allclose(result.values, anew.values, atol=1e-3 * result.deviation.max())


def test_a_trial_that_nothing_holds_turns_a_fit_back(small: Model, arranged: Arrangement) -> None:
    fit, train = arranged.fit, arranged.train
    # No stiffness is left, and less than none.
    loose = fit.model.with_system(stiffness=-1e3 * np.eye(fit.model.system.n_dof))
    with pytest.raises(ModelError, match="negative eigenvalue"):
        train.predict(loose, fit.prediction)

    @dataclass(frozen=True)
    class Unheld(Comparison):
        """Nothing holds a model whose kt is above 1.1 of the drawing; the fit starts worse than with no prediction."""

        def predict(self, model: Model, before: Prediction | None = None, starts: object = None) -> Prediction:
            del starts
            stiff = model.contact(model.lines["left"][0]).tangential_stiffness
            if stiff > 1.1 * small.contact(small.lines["left"][0]).tangential_stiffness:
                return super().predict(loose, before)
            return super().predict(model, before)

    held = Unheld(**{item.name: getattr(train, item.name) for item in fields(Comparison)})
    # The best kt is 1.06; from far below the first step goes beyond 1.1, from above there is no state at all.
    for start in (0.7, 1.3):
        values = fit.unknowns.vanishing.copy()
        values[fit.unknowns.names.index("kt")] = start
        again = calibrate(held, fit.unknowns, values, fit.prediction)
        assert again.chi2 == pytest.approx(fit.chi2, abs=1.0)


def test_chi2_is_least_at_the_fit(arranged: Arrangement) -> None:
    fit = arranged.fit
    for number, deviation in enumerate(fit.deviation):
        rises = []
        for side in (-1, 1):
            values = np.array(fit.values)
            values[number] += side * deviation
            model = fit.unknowns.compose(values)
            residual = arranged.train.residual(arranged.train.predict(model, fit.prediction))
            away = (values - fit.unknowns.vanishing) / fit.unknowns.prior
            rises.append(residual @ residual + away @ away - fit.chi2)
        # One standard deviation (with the others free) raises chi^2 by 1 or more; contacts begin to slip on the way.
        assert np.mean(rises) > 0.8
        # A fit may end where chi^2 is less than `MIN_GAIN` above its minimum, which is its root away.
        assert min(rises) > 1 - 2 * np.sqrt(MIN_GAIN)


def test_the_jacobian_is_that_of_the_residual(arranged: Arrangement) -> None:
    fit, step = arranged.fit, 1e-5
    for number in range(len(fit.values)):
        ends = []
        for side in (-1, 1):
            values = np.array(fit.values)
            values[number] += side * step
            ends.append(arranged.train.residual(arranged.train.predict(fit.unknowns.compose(values), fit.prediction)))
        exact = -(ends[1] - ends[0]) / (2 * step)
        result = fit.jacobian[: len(exact), number]
        # Newton's 1e-9 over the step, and curvature.
        np.testing.assert_allclose(result, exact, rtol=0, atol=1e-4 * np.abs(exact).max())
    np.testing.assert_array_equal(fit.jacobian[-len(fit.values) :], np.diag(1 / fit.unknowns.prior))


def test_it_stops_at_a_bound(arranged: Arrangement, small: Model) -> None:
    kt, mu, zeta = arranged.calibration
    tight = replace(kt, parameters=(replace(kt.parameters[0], upper=1.02, typical=1.01),))
    unknowns = Unknowns.from_effects(small, [(item, item.deviation) for item in (tight, mu, zeta)], ())
    fit = calibrate(arranged.train, unknowns, unknowns.vanishing)
    assert fit.values[0] == 1.02
    assert fit.chi2 > arranged.fit.chi2
    # The others are where chi^2 is least with the first held: no step of theirs gains more than what ends a fit.
    gradient = fit.jacobian.T @ fit.residual
    assert gradient[0] > 0
    rest = fit.jacobian[:, 1:]
    gain = gradient[1:] @ np.linalg.solve(rest.T @ rest, gradient[1:])
    assert gain < 1.0


def test_chi2_falls_from_step_to_step(arranged: Arrangement) -> None:
    told: list[float] = []
    report: Callable[[float], None] = told.append
    unknowns = arranged.unknowns(())
    fit: Fit = calibrate(arranged.train, unknowns, unknowns.vanishing, report=report)
    assert len(told) > 1
    assert (np.diff(told) < 0).all()
    assert told[-1] == fit.chi2
    # From where it has ended, there is nothing to gain.
    again = calibrate(arranged.train, unknowns, fit.values, fit.prediction)
    assert again.chi2 == pytest.approx(fit.chi2, abs=0.1)


class Valley:
    """Residuals of Rosenbrock's function: a curved valley in which an updated Jacobian soon misleads."""

    search = Search(gain=1e-6, steps=200)

    def predict(self, model: Any, _nearby: Any = None, _starts: Any = None) -> Any:
        return model

    def residual(self, prediction: Any) -> Any:
        x, y = prediction
        return np.array([30 * (y - x**2), 1 - x])

    def has_prediction(self, _prediction: Any) -> Any:
        return np.ones(2, dtype=bool)

    def slopes(self, _unknowns: Any, values: Any, _model: Any, _prediction: Any, _first: int = 0) -> Any:
        return np.array([[60 * values[0], -30], [1, 0]])

    def covariance(self, _residual: Any, _jacobian: Any, _size: Any) -> Any:
        return np.eye(2)


def test_a_step_that_an_updated_jacobian_misleads_does_not_end_a_quick_fit() -> None:
    free: Any = SimpleNamespace(
        n_start=0, size=np.ones(2), bounds=[(-5.0, 5.0)] * 2, prior=np.full(2, np.inf), vanishing=np.zeros(2),
        prior_residuals=lambda _: np.zeros(2), clipped=lambda it: it, compose=lambda it: it, limited=lambda it: it,
    )  # fmt: skip
    fit = calibrate(Valley(), free, np.array([-2.0, -2.0]), ending=Ending.QUICK)
    np.testing.assert_allclose(fit.values, 1.0, atol=1e-3)  # the next step gains less than 1e-6


def test_a_prior_alone_holds_what_the_data_do_not_tell(arranged: Arrangement, small: Model) -> None:
    held = [(item, 1e-6) for item in arranged.calibration]
    unknowns = Unknowns.from_effects(small, held, ())
    fit = calibrate(arranged.train, unknowns, unknowns.vanishing)
    # A prior of 1e-6 against data that tell 1e-3 or so.
    np.testing.assert_allclose(fit.values, 1.0, atol=1e-4)
    np.testing.assert_allclose(fit.deviation, 1e-6, rtol=0.01)


def test_what_is_not_found_counts_as_far_off(arranged: Arrangement) -> None:
    value = np.array(arranged.fit.prediction.value)
    value[3] = np.nan
    residual = arranged.train.residual_of(value)
    lost = ~np.isfinite(arranged.train.features.of_values(value))
    assert lost.sum() >= 2
    assert (residual[lost] == NOT_FOUND).all()
    assert np.isfinite(residual).all()


def test_held_out_data_are_none_of_those_fitted(arranged: Arrangement) -> None:
    assert (arranged.train.observed.count == 3).all()
    assert (arranged.held_out.observed.count == 1).all()
    np.testing.assert_array_equal(arranged.held_out_without_jitter.measured, arranged.held_out.measured)
    # Without jitter in it, a covariance is smaller.
    both = [item.whitening.modes for item in (arranged.held_out, arranged.held_out_without_jitter)]
    # Frequency and force of both tests, and two lines.
    assert both[0].shape[1] - both[1].shape[1] == 6
    assert {effect.kind for effect, _ in arranged.jitter} == {"jitter"}


def test_one_repeat_cannot_be_arranged(small: Model, paper: ModuleType, campaign: Campaign) -> None:
    one = paper.make_campaign(small, n_repeat=1, held=())
    single = replace(one, held_out=HeldOut(levels=(paper.LEVELS[1],)))
    with pytest.raises(CampaignError, match="repeat the test"):
        arrange(single, small, list_calibration_parameters(small), EXACT_MODEL)
