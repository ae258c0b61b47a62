"""A campaign prepared for comparison with a model: training and held-out features, their covariance, a first fit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import find_sweep_directions, split_held_out
from correlation.metric.jump_error import compute_jump_errors
from correlation.model import Model
from correlation.noise.error_size import NO_ERROR, ErrorSize
from correlation.noise.nuisance import Budget
from correlation.noise.scatter import Scatter
from correlation.prediction import Prediction
from diagnosis.candidate.catalogue import Catalogue, list_effects
from diagnosis.candidate.effect import Effect
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.calibration import Ending, Fit, calibrate, recalibrate
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.finer_model import FinerModel
from diagnosis.fit.fit_parameter import Unknowns, Values
from diagnosis.fit.jitter import list_jitter
from diagnosis.fit.model_error_fit import alternate, fit_from_fit, fit_from_scratch, get_error_size, reweigh_slopes
from diagnosis.fit.problem import EffectSelection, Refit
from diagnosis.fit.weighting import (
    FEW_DRAWS,
    Measured,
    allow_model_error,
    downweight_other_branch,
    join_measured,
    leave_out_model_error,
    make_comparison,
    make_comparisons,
    resize_model_error,
    update_model_error,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Arrangement:
    """Measurements and model of a diagnosis.

    Parameters
    ----------
    base
        Model without the added effects.
    calibration
        Calibration parameters, which every fit sets.
    added
        Effects added in earlier rounds; every fit sets their values again.
    train, held_out
        Comparisons with the measurements of a fit, and with those that test it.
    held_out_without_jitter, jitter
        Held-out comparison without jitter in its covariance, and the jitter as effects with priors, which a test on
        other repeats fits.
    fit
        Fit of the calibration parameters and the added effects to `train`.
    budget
        Numerical error of the model.
    finer
        Finer models of the budget, calibrated to the prediction of the fit.
    """

    base: Model
    calibration: tuple[CalibrationParameter, ...]
    added: tuple[Effect, ...]
    train: Comparison
    held_out: Comparison
    held_out_without_jitter: Comparison
    jitter: tuple[tuple[Effect, float], ...]
    fit: Fit
    budget: Budget
    finer: tuple[FinerModel, ...]

    selection: ClassVar[EffectSelection] = EffectSelection()

    @property
    def model_error_size(self) -> ErrorSize:
        """Model error that the fit leaves."""
        return get_error_size(self.train)

    @property
    def jitter_of_one_repeat(self) -> list[tuple[Effect, float]]:
        """The jitter with the standard deviations of one repeat, not of the mean over those of the held-out data."""
        repeats = float(np.median(self.held_out_without_jitter.observed.count))
        return [(effect, float(np.sqrt(repeats)) * deviation) for effect, deviation in self.jitter]

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        """Calibration parameters with their priors; added effects and the given ones without."""
        return make_unknowns(self.base, self.calibration, [*self.added, *effects])

    def with_fit(self, train: Comparison, fit: Fit) -> "Arrangement":
        """The same with another fit and its model error."""
        size = get_error_size(train)
        return replace(
            self, train=train, fit=fit, held_out=resize_model_error(self.held_out, size),
            held_out_without_jitter=resize_model_error(self.held_out_without_jitter, size),
        )  # fmt: skip

    def with_refit(self, fit: Fit, by: Comparison) -> "Arrangement":
        """The same with a fit of other parameters, continued from its values, and its model error.

        Parameters
        ----------
        fit
            The fit.
        by
            Comparison that it was fitted to.
        """
        # With the model error of another fit the first steps would lead away from the minimum.
        train = update_model_error(self.train, fit.prediction)
        slopes = reweigh_slopes(fit, by, train)
        train, last = alternate(train, recalibrate(train, fit, slopes=slopes, ending=Ending.QUICK))
        return self.with_fit(train, recalibrate(train, last, slopes=last.jacobian))

    def with_refit_without(self, effect: Effect, fit: Fit) -> "Arrangement":
        """The same with a fit without an effect that starts from one with it, and its model error."""
        return self.with_refit_from([], fit.values[: len(fit.values) - len(effect.parameters)], fit.prediction)

    def with_refit_from(
        self, effects: Sequence[Effect], values: Values, nearby: Prediction, by: Comparison | None = None
    ) -> "Arrangement":
        """The same with a fit of effects that starts from given values, and its model error.

        Parameters
        ----------
        effects
            Effects in addition to the calibration parameters and the added effects.
        values
            Values of all of these, shape (p,).
        nearby
            Prediction from which the states of the fit start.
        by
            Comparison for the first fit; by default with the model error at the given values, so that the parameters
            do not first absorb residuals that they cannot explain.
        """
        unknowns = self.unknowns(effects)
        if by is None:
            by = update_model_error(self.train, self.train.predict(unknowns.compose(values), nearby))
        return self.with_refit(calibrate(by, unknowns, values, nearby, ending=Ending.QUICK), by)

    def cost_with_error_left(self, fit: Fit) -> float:
        """Cost of a fit with its model error estimated again; without model error if `train` has none [-]."""
        if get_error_size(self.train) == NO_ERROR:
            return fit.chi2 + self.train.log_weight
        train = self._with_error_left(fit)
        residual, m = train.residual(fit.prediction), fit.n_number
        return float(residual @ residual + fit.residual[m:] @ fit.residual[m:]) + train.log_weight

    def find_error_left(self, fit: Fit) -> ErrorSize:
        """Size of the model error of a fit; none if `train` has none."""
        return NO_ERROR if get_error_size(self.train) == NO_ERROR else get_error_size(self._with_error_left(fit))

    def _with_error_left(self, fit: Fit) -> Comparison:
        """Training data with the model error of a fit."""
        return update_model_error(self.train, fit.prediction)

    @property
    def cost(self) -> float:
        """-2 ln of the density of training data, fitted values and model error, up to a constant [-]."""
        return self.fit.chi2 + self.train.log_weight

    def downweight_other_branch(self, model: Model) -> "Arrangement":
        """The same with negligible weight where a model is on another branch than the structure was."""
        predicted = self.held_out.predictor.predict(model)
        train = downweight_other_branch(self.train, self.train.predictor.predict(model))
        downweighted = replace(
            self, held_out=downweight_other_branch(self.held_out, predicted),
            held_out_without_jitter=downweight_other_branch(self.held_out_without_jitter, predicted),
        )  # fmt: skip
        if train is self.train:
            return downweighted
        fit = recalibrate(train, self.fit, ending=Ending.QUICK)
        # The downweighted points contributed to the model error.
        train, fit = alternate(train, fit)
        return downweighted.with_fit(train, recalibrate(train, fit, ending=Ending.EXACT))

    def tested(self, effect: Effect | None, fit: Fit) -> Refit:
        """Test on the held-out data, with the jitter of their repeats fitted within its priors.

        The model error is estimated from the held-out data: that of the training data is too small if the model error
        is larger at other levels.
        """
        return self._test(effect, fit, *alternate(self.held_out_without_jitter, self._fit_jitter(fit)))

    def test_uncalibrated(self, model: Model) -> Refit:
        """The same test of an uncalibrated model, with the model error of the fit.

        Its own model error is large and slow to estimate.
        """
        fit = self.fit.with_model(self.train, model, self.train.predict(model, self.fit.prediction))
        return self._test(None, fit, self.held_out_without_jitter, self._fit_jitter(fit))

    def _fit_jitter(self, fit: Fit) -> Fit:
        """Fit of the jitter to the residual of the held-out data."""
        unknowns = Unknowns.from_effects(fit.model, self.jitter, ())
        return calibrate(self.held_out_without_jitter, unknowns, unknowns.vanishing, fit.prediction)

    def _test(self, effect: Effect | None, fit: Fit, held_out: Comparison, jitter_fit: Fit) -> Refit:
        return Refit(
            effect=effect, fit=fit, held_out_reduced_chi2=jitter_fit.chi2 / jitter_fit.n_number,
            error=self.train.error(fit.prediction), held_out_error=held_out.error(jitter_fit.prediction),
            n_held_out=jitter_fit.n_number,
            reduced_chi2_without_model_error=_find_chi2_without_model_error(self.train, fit.prediction),
            held_out_reduced_chi2_without_model_error=_find_chi2_without_model_error(held_out, jitter_fit.prediction),
            held_out_jumps=compute_jump_errors(held_out.observed, jitter_fit.prediction, held_out.predictor.sweeps),
            held_out_cost=jitter_fit.chi2 + held_out.log_weight + _log_width(jitter_fit),
        )  # fmt: skip


def arrange(
    campaign: Campaign,
    base: Model,
    calibration: Sequence[CalibrationParameter],
    budget: Budget,
    *,
    added: Sequence[AddedEffect] = (),
    catalogue_of: Callable[[Model], Catalogue] = list_effects,
) -> Arrangement:
    """Prepare features, covariance and the first fit.

    Parameters
    ----------
    campaign, base
        Measurements and model without the added effects; sensors agree by name.
    calibration
        Calibration parameters, which every fit sets.
    budget
        Numerical error of the model.
    added
        Effects added in earlier rounds, with their start values.
    catalogue_of
        Effects of a finer model, in which the added ones are looked up.

    Raises
    ------
    CampaignError
        Nothing is held out, there is a single repeat, or the model lacks a sensor.
    """
    effects = tuple(item.effect for item in added)
    unknowns = make_unknowns(base, calibration, effects)
    finer = tuple(
        FinerModel(
            unknowns=replace(
                unknowns, base=item, effects=(*calibration, *(catalogue_of(item).alike(effect) for effect in effects))
            ),
            n_calibration=len(calibration),
        )
        for item in budget.refined
    )
    values = make_first_values(unknowns, added)
    result = _compare_campaign(campaign, unknowns, values, budget, finer)
    return Arrangement(base=base, calibration=tuple(calibration), added=effects, budget=budget, **result)


def make_first_values(unknowns: Unknowns, added: Sequence[AddedEffect]) -> Values:
    """Start of a fit: calibration parameters at their neutral values, added effects at their last ones, shape (p,)."""
    last = [value for item in added for value in item.values]
    return np.array([*unknowns.vanishing[: len(unknowns.prior) - len(last)], *last])


def arrange_anew(arrangement: Arrangement, campaign: Campaign) -> Arrangement:
    """Arrangement of another campaign of the same tests with the same model; its fit starts from that of the first."""
    of = arrangement
    return replace(of, **_compare_campaign(campaign, of.unknowns([]), of.fit.values, of.budget, of.finer))


def _compare_campaign(
    campaign: Campaign,
    unknowns: Unknowns,
    values: Values,
    budget: Budget,
    finer: Sequence[FinerModel],
) -> dict[str, Any]:
    """Fields of an arrangement that depend on the campaign: comparisons, jitter and fit."""
    data_sets = _split_data_sets(campaign)
    model = unknowns.compose(values)
    # The error of a mesh does not depend on the measurements.
    known = all(item.shift is not None for item in finer)
    prediction = data_sets[0].predictor.predict(model)
    # Jitter and numerical error depend on where the contacts slip, and thus on the fit that they weight.
    refined = [item.compose(values) for item in finer]
    first, _ = make_comparison(data_sets[0], model, prediction, budget, refined, FEW_DRAWS, fitted=False)
    first, fit = fit_from_scratch(first, unknowns, values, model, prediction, budget.model)
    if not known:
        finer = [item.calibrated(first, fit) for item in finer]
    refined = [item.compose(fit.values) for item in finer]
    (train, _), held_out = _weigh_data_sets(data_sets, fit, budget, refined)
    train, fit = fit_from_fit(train, fit, budget.model)
    if not known:
        finer = [item.calibrated(train, fit) for item in finer]
    return {
        "train": train,
        "fit": fit,
        "finer": tuple(finer),
        **_arrange_held_out(held_out, fit, budget, get_error_size(train)),
    }


def expect_usual_error(arrangement: Arrangement) -> Arrangement:
    """The same with model error of its usual size in the training data, which hides no large effect, and its fit."""
    of, usual = arrangement.fit, ErrorSize.usual(arrangement.budget.model)
    train = allow_model_error(
        leave_out_model_error(arrangement.train), of.model, of.prediction, arrangement.budget.model, usual
    )
    fit = recalibrate(train, of, ending=Ending.QUICK)
    return replace(arrangement, train=train, fit=fit)


def arrange_with_effect(
    campaign: Campaign, arrangement: Arrangement, effect: Effect, fit: Fit, catalogue_of: Callable[[Model], Catalogue]
) -> Arrangement:
    """The same measurements with the covariance of the model with an effect, and the fit including the effect.

    The modes of friction histories, jitter and a coarse mesh depend on where contacts slip, and thus on the model.
    A model error without the effect may disappear with it. The outliers stay the same, so that no effect gains by
    downweighting other points.

    Parameters
    ----------
    campaign, arrangement
        Measurements and model.
    effect, fit
        Effect and its fit, with the calibration parameters and the added effects.
    catalogue_of
        As in `arrange`.
    """
    of = arrangement
    finer = [item.with_effects([catalogue_of(item.unknowns.base).alike(effect)]) for item in of.finer]
    refined = [item.compose(fit.values) for item in finer]
    (train, _), held_out = _weigh_data_sets(
        _split_data_sets(campaign), fit, of.budget, refined, [of.train, of.held_out]
    )
    train, fit = fit_from_fit(train, fit, of.budget.model)
    return replace(of, train=train, fit=fit, **_arrange_held_out(held_out, fit, of.budget, get_error_size(train)))


def _split_data_sets(campaign: Campaign) -> tuple[Measured, Measured]:
    """Training and held-out measurements."""
    training, held_out = split_held_out(campaign)
    sweeps = find_sweep_directions(campaign)
    return Measured.prepare(training, sweeps), Measured.prepare(held_out, sweeps)


def _weigh_data_sets(
    data_sets: Sequence[Measured],
    fit: Fit,
    budget: Budget,
    refined: Sequence[Model],
    likes: Sequence[Comparison] | None = None,
) -> list[tuple[Comparison, Scatter]]:
    """Comparisons of training and held-out data with the covariance of a fitted model; each state is solved once."""
    prediction = join_measured(data_sets).predictor.predict(fit.model, fit.prediction)
    return make_comparisons(data_sets, fit.model, prediction, budget, refined, likes=likes)


def _arrange_held_out(weighed: tuple[Comparison, Scatter], fit: Fit, budget: Budget, size: ErrorSize) -> dict[str, Any]:
    """Fields of an arrangement for the held-out data, with model error of the size found in the training data."""
    comparison, scatter = weighed
    prediction = comparison.predictor.predict(fit.model, fit.prediction)
    held_out = allow_model_error(comparison, fit.model, prediction, budget.model, size)
    without_jitter, shifts = _take_out_jitter(held_out, scatter, fit.model)
    return {"held_out": held_out, "held_out_without_jitter": without_jitter, "jitter": tuple(shifts)}


def _take_out_jitter(
    comparison: Comparison, scatter: Scatter, model: Model
) -> tuple[Comparison, list[tuple[Effect, float]]]:
    """Comparison without jitter in its covariance, and the jitter as effects with priors."""
    n_jitter = sum(len(covariance) for covariance in scatter.jitter)
    modes = comparison.whitening.modes
    assert modes is not None
    without = replace(comparison.whitening, modes=modes[:, n_jitter:])
    error = comparison.model_error
    if error is not None:
        assert error.without.modes is not None
        stated = replace(error.without, modes=error.without.modes[:, n_jitter:])
        error = replace(error, without=stated)
    # The jitter of a mean over as many repeats as most points have.
    repeats = float(np.median(comparison.observed.count))
    return replace(comparison, whitening=without, model_error=error), list_jitter(
        model, [item / repeats for item in scatter.jitter]
    )


def _log_width(fit: Fit) -> float:
    """-2 ln of the ratio of posterior to prior volume of all parameters of a fit, by Laplace's approximation [-]."""
    scaled = fit.jacobian * fit.unknowns.prior
    return float(np.linalg.slogdet(scaled.T @ scaled)[1])


def _find_chi2_without_model_error(comparison: Comparison, prediction: Prediction) -> float | None:
    """Reduced chi-squared without model error, if there is any."""
    if comparison.model_error is None:
        return None
    return float(np.mean(leave_out_model_error(comparison).residual(prediction) ** 2))


def make_unknowns(base: Model, calibration: Sequence[CalibrationParameter], effects: Sequence[Effect]) -> Unknowns:
    """Calibration parameters with their priors, then effects without."""
    return Unknowns.from_effects(base, [(item, item.deviation) for item in calibration], effects)
