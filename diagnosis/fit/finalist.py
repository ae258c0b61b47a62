"""Finalists: effects fitted to the end, each by the covariance of its own model as well.

The covariance of a model that lacks an effect is wrong where this effect acts, and so is what it says of others. That
of the model with the effect is wrong where the effect is not there. An effect gains what it gains by both.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.fit.arrangement import Arrangement, weigh_beside
from diagnosis.fit.calibration import calibrate
from diagnosis.fit.problem import Refit
from diagnosis.step import RunStep, compute_step

#: An effect that makes the held-out error larger by this factor gains nothing there, whatever chi^2 says: an engineer
#: would not add it. Less is what the jitter of held-out repeats does to an error [-].
WORSE = 1.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Finalist:
    """An effect, or none, its fit, and the arrangement by the covariance of the model with it."""

    refit: Refit
    arrangement: Arrangement

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.refit.name


def weigh_each(
    campaign: Campaign,
    arrangement: Arrangement,
    before: Refit,
    refits: Sequence[Refit],
    catalogue_of: Callable[[Model], Catalogue],
    run_step: RunStep = compute_step,
) -> list[Finalist]:
    """Fit effects anew, each by the covariance of its own model.

    Parameters
    ----------
    campaign, arrangement
        Measurements and model.
    before, refits
        Fits without an effect and with each, by the covariance of the model without them.
    catalogue_of
        As in `diagnosis.fit.arrangement.arrange`.
    run_step
        Looks up the stored result of a step, or computes it.
    """

    def weigh(refit: Refit) -> Finalist:
        assert refit.effect is not None
        beside = weigh_beside(campaign, arrangement, refit.effect, refit.fit, catalogue_of)
        own = beside.tested(refit.effect, beside.fit)
        of = before.fit
        without = beside.tested(None, calibrate(beside.train, of.unknowns, of.values, of.prediction))
        falls = [fall(before, refit), fall(without, own)]
        held_falls = [held_fall(before, refit), held_fall(without, own)]
        if own.held_error > WORSE * without.held_error:
            held_falls.append(0.0)
        return Finalist(refit=replace(own, gain=min(falls), held_gain=min(held_falls)), arrangement=beside)

    return [run_step(f"{each.name} by its own covariance", partial(weigh, each)) for each in refits]


def fall(before: Refit, refit: Refit) -> float:
    """Fall of chi^2 of the training data, by one covariance."""
    return before.fit.chi2 - refit.fit.chi2


def held_fall(before: Refit, refit: Refit) -> float:
    """Fall of chi^2 of the held-out data, by one covariance."""
    return before.held_chi2 * before.n_held - refit.held_chi2 * refit.n_held
