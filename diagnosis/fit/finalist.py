"""Finalists: effects fitted to the end, each that gains more than chance by the covariance of its own model as well.

The covariance of a model that lacks an effect is wrong where the effect is present, and that of a model with the effect
is wrong where it is absent. The gain of an effect is therefore the smaller one of its gains by both covariances.

By either covariance, the fits with the effect and without have model errors of their own sizes, since a missing effect
may have been taken for model error. The gain is the fall of -2 ln p, in which a larger covariance costs its
determinant.
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
from diagnosis.fit.calibration import Ending, Fit
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.model_error_fit import fit_from_lowest_level
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.fit.weighting import resize_model_error
from diagnosis.step import RunStep, compute_step

#: An effect is not named, whatever it gains, if the held-out data are further off by these factors: their reduced
#: chi-squared by noise and stated errors, as far as it is beyond 1, and where these do not explain it, their error
#: relative to what was measured. That is the error of peaks above all, which move with what is explained [-].
MAX_CHI2_RISE, MAX_ERROR_RISE = 1.1, 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Finalist:
    """An effect, or none, its fit, and the arrangement by the covariance that it was weighed by last."""

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
    """Fit an effect anew, by the covariance of its own model.

    The gain of an effect is the smaller one by both covariances. Where chance explains that by the common one, no
    verdict names the effect, and the other is left out.

    Parameters
    ----------
    campaign, arrangement
        Measurements and model.
    baseline
        Fit without an effect by `arrangement`.
    catalogue_of
        As in `diagnosis.fit.arrangement.arrange`.
    by, refit
        Fit with the effect, and the comparison that it was fitted to.
    chance
        Gain that chance explains; every effect is fitted by its own covariance by default.
    """
    assert refit.effect is not None
    # By the covariance that all fits have in common, which is that of `arrangement`, and by its own.
    common, fit = _refit(arrangement, refit.fit, by)
    if arrangement.cost - common.cost <= chance:
        tested = _test_by_covariances(refit.effect, [common], [arrangement], [baseline])
        return Finalist(refit=tested, arrangement=common)
    own = arrange_with_effect(campaign, arrangement, refit.effect, fit, catalogue_of)
    own_without = own.with_refit(baseline.fit, arrangement.train)
    common_without = arrangement
    if min(common_without.cost - common.cost, own_without.cost - own.cost) > arrangement.selection.least_gain:
        # A fit without the effect that is not at its minimum would leave the effect a gain that is none.
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


def _test_by_covariances(
    effect: Effect,
    with_effect: Sequence[Arrangement],
    without_effect: Sequence[Arrangement],
    tests_without: Sequence[Refit],
) -> Refit:
    """Test of an effect by the last of some covariances, with the least that it gains by any of them.

    Parameters
    ----------
    effect
        The effect.
    with_effect, without_effect
        Fits with the effect and without, one by each covariance.
    tests_without
        Tests of the latter.
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
    """Fit effects anew, each by the covariance of its own model, until the rest is too far behind one that gains.

    Parameters
    ----------
    screening
        Arrangement that the effects were fitted by.
    refits
        Fits with each effect, the best first.
    refit_one
        Fits one of them, as `refit_by_own_covariance` does with its other arguments given.
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


def _refit(arrangement: Arrangement, fit: Fit, by: Comparison) -> tuple[Arrangement, Fit]:
    """Fit with an effect and the model error that it leaves, and the quick fit that it began with.

    Where contacts slip in the model at frequencies at which they stick in the test, chi^2 has several minima, and a fit
    without the effect may have moved the calibration parameters into the wrong one. That leaves an unusual model error.
    Another fit then begins with the lowest level alone, where the model is almost linear, and the more probable counts.
    """
    result, usual = arrangement.with_refit(fit, by), ErrorSize.usual(arrangement.budget.model)
    if result.model_error_size.is_within(usual):
        return result, fit
    train = resize_model_error(arrangement.train, usual)
    second = fit_from_lowest_level(train, fit.unknowns, fit.values, fit.prediction, ending=Ending.QUICK)
    other = arrangement.with_refit(second, train)
    return (other, other.fit) if other.cost < result.cost else (result, fit)


def compare(refit: Refit, without: Refit, gain: float) -> Refit:
    """The test of a fit with its gains beyond one that lacks an effect, of which that of the training data is given."""
    held_out_gain = without.held_out_cost - refit.held_out_cost
    return replace(refit, gain=gain, held_out_gain=held_out_gain, worsens=is_worse(refit, without))


def is_worse(refit: Refit, without: Refit) -> bool:
    """Whether held-out data are further off with an effect than without it."""
    after, before = (max(item.held_out_reduced_chi2_by_noise, 1.0) for item in (refit, without))
    return after > MAX_CHI2_RISE * before or (
        after > UNEXPLAINED_CHI2 and refit.held_out_error > MAX_ERROR_RISE * without.held_out_error
    )
