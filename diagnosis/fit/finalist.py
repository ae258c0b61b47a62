"""Finalists: effects that are fitted to the end; if the gain exceeds chance, also with the covariance of their model.

The covariance of a model that lacks an effect is wrong where the effect is present, and that of a model with the effect
is wrong where it is absent. The gain of an effect is therefore the smaller of its gains with both covariances.

With either covariance, the model error is estimated separately for the fits with and without the effect, since a
missing effect may have been mistaken for model error. The gain is the fall of -2 ln p, which includes the determinant
of the covariance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from correlation.noise.error_size import ErrorSize
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect
from diagnosis.fit.arrangement import Arrangement, arrange_with_effect
from diagnosis.fit.calibration import MIN_GAIN, Ending, Fit
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.fit_parameter import make_start
from diagnosis.fit.model_error_fit import fit_from_lowest_level
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.fit.weighting import resize_model_error
from diagnosis.step import RunStep, compute_step

#: An effect is not named, regardless of its gain, if a held-out error rises by more than these factors: the reduced
#: chi-squared by noise and stated errors, limited from below by 1; and, where these do not explain it, the error
#: relative to the measured values. The latter is dominated by peaks, which shift with an effect [-].
MAX_CHI2_RISE, MAX_ERROR_RISE = 1.1, 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Finalist:
    """Fit with one effect or none, and the arrangement with the covariance of the last fit."""

    refit: Refit
    arrangement: Arrangement

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.refit.name


def refit_by_own_covariance(
    campaign: Campaign,
    arrangement: Arrangement,
    baseline: Refit,
    catalogue_of: Callable[[Model], Catalogue],
    by: Comparison,
    refit: Refit,
    *,
    chance: float = -np.inf,
) -> Finalist:
    """Refit an effect with the covariance of its own model.

    The gain of an effect is the smaller one with both covariances. If chance explains the gain with the common one, no
    verdict names the effect, and the fit with its own covariance is omitted.

    Parameters
    ----------
    campaign, arrangement
        Measurements and model.
    baseline
        Fit without an effect by `arrangement`.
    catalogue_of
        As in `diagnosis.fit.arrangement.arrange`.
    by, refit
        Comparison, and the fit with the effect to it.
    chance
        Gain that chance explains; by default every effect is fitted with its own covariance.
    """
    assert refit.effect is not None
    # First with the common covariance of all fits, that of `arrangement`; then with the own covariance.
    common, fit = _refit(arrangement, refit.effect, refit.fit, by)
    if arrangement.cost - common.cost <= chance:
        tested = _test_by_covariances(refit.effect, [common], [arrangement], [baseline])
        return Finalist(refit=tested, arrangement=common)
    own = arrange_with_effect(campaign, arrangement, refit.effect, fit, catalogue_of)
    own_without = own.with_refit(baseline.fit, arrangement.train)
    own = _restart_if_missed(own, own_without, refit.effect)
    common_without = arrangement
    if min(common_without.cost - common.cost, own_without.cost - own.cost) > arrangement.selection.least_gain:
        # A fit without the effect that is not converged to its minimum would give the effect a spurious gain.
        common_without = min(
            common_without, common_without.with_refit_without(refit.effect, common.fit), key=attrgetter("cost")
        )
        own_without = min(own_without, own.with_refit_without(refit.effect, own.fit), key=attrgetter("cost"))
    without = [
        baseline if common_without is arrangement else common_without.tested(None, common_without.fit),
        own_without.tested(None, own_without.fit),
    ]
    tested = _test_by_covariances(refit.effect, [common, own], [common_without, own_without], without)
    return Finalist(refit=tested, arrangement=own)


def _restart_if_missed(with_effect: Arrangement, without: Arrangement, effect: Effect) -> Arrangement:
    """The fit with an effect, started again from the fit without it if that one is more probable.

    The model with the effect contains the one without: a fit with a higher cost missed the minimum. If the derivative
    by the effect is zero there, the result is the fit without it, at the neutral strength.
    """
    if with_effect.cost <= without.cost + MIN_GAIN:
        return with_effect
    fit = without.fit
    start = make_start(fit.values, effect, effect.parameters[0].vanishes)
    second = with_effect.with_refit_from([effect], start, fit.prediction, without.train)
    return min(with_effect, second, key=attrgetter("cost"))


def _test_by_covariances(
    effect: Effect,
    with_effect: Sequence[Arrangement],
    without_effect: Sequence[Arrangement],
    tests_without: Sequence[Refit],
) -> Refit:
    """Test of an effect with the last of some covariances, with the smallest of its gains with all of them.

    Parameters
    ----------
    effect
        The effect.
    with_effect, without_effect
        Fits with and without the effect, one with each covariance.
    tests_without
        Tests of the fits without the effect.
    """
    tests = [item.tested(effect, item.fit) for item in with_effect]
    costs = [(one.held_out_cost, other.held_out_cost) for one, other in zip(tests_without, tests, strict=True)]
    return replace(
        tests[-1],
        gain=min(one.cost - other.cost for one, other in zip(without_effect, with_effect, strict=True)),
        held_out_gain=min(one - other for one, other in costs),
        cost=with_effect[-1].cost + tests[-1].held_out_cost,
        worsens=any(is_worse(tests[-1], item) for item in tests_without),
    )


def refit_each_by_own_covariance(
    screening: Arrangement,
    refits: Sequence[Refit],
    refit_one: Callable[[Refit], Finalist],
    run_step: RunStep = compute_step,
) -> list[Finalist]:
    """Refit effects, each with the covariance of its own model.

    Once an effect gains on training and held-out data, only those with a cost close to the lowest one are refitted.

    Parameters
    ----------
    screening
        Arrangement of the given fits.
    refits
        Fits with each effect, the best first.
    refit_one
        Refits one of them: `refit_by_own_covariance` with its other arguments given.
    run_step
        Looks up the stored result of a step, or computes it.
    """
    result: list[Finalist] = []
    costs = [screening.cost_with_error_left(item.fit) for item in refits]
    for item, cost in zip(refits, costs, strict=True):
        gains = any(
            min(other.refit.gain, other.refit.held_out_gain) > 0 and not other.refit.worsens for other in result
        )
        if not gains or cost < min(costs) + screening.selection.largest_chi2_gap:
            result.append(run_step(f"{item.name} by its own covariance", partial(refit_one, item)))
    return result


def _refit(arrangement: Arrangement, effect: Effect, fit: Fit, by: Comparison) -> tuple[Arrangement, Fit]:
    """Fit with an effect and its model error, and the fit from which it started.

    If contacts slip in the model at frequencies at which they stick in the test, chi^2 has several minima, and the fit
    without the effect may have moved the calibration parameters to the wrong one. The model error is then unusually
    large. A second fit starts with the lowest level alone, where the model is almost linear; the more probable fit is
    taken. If even that is worse than the fit without the effect, it starts again from there.
    """
    result, usual = arrangement.with_refit(fit, by), ErrorSize.usual(arrangement.budget.model)
    if not result.model_error_size.is_within(usual):
        train = resize_model_error(arrangement.train, usual)
        second = fit_from_lowest_level(train, fit.unknowns, fit.values, fit.prediction, ending=Ending.QUICK)
        other = arrangement.with_refit(second, train)
        result, fit = (other, other.fit) if other.cost < result.cost else (result, fit)
    again = _restart_if_missed(result, arrangement, effect)
    return (result, fit) if again is result else (again, again.fit)


def compare(refit: Refit, without: Refit, gain: float) -> Refit:
    """The test of a fit with its gains over a fit without the effect; `gain` is that of the training data."""
    held_out_gain = without.held_out_cost - refit.held_out_cost
    return replace(refit, gain=gain, held_out_gain=held_out_gain, worsens=is_worse(refit, without))


def is_worse(refit: Refit, without: Refit) -> bool:
    """Whether an effect raises the error of the held-out data beyond `MAX_CHI2_RISE` or `MAX_ERROR_RISE`."""
    after, before = (max(item.held_out_reduced_chi2_by_noise, 1.0) for item in (refit, without))
    return after > MAX_CHI2_RISE * before or (
        after > UNEXPLAINED_CHI2 and refit.held_out_error > MAX_ERROR_RISE * without.held_out_error
    )
