"""One round of diagnosis of a case, each expensive step kept, so that it goes on where it was interrupted."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.metric.misfit import Misfit
from correlation.model import Model
from correlation.sensor_placement import with_sensors
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import EffectError
from diagnosis.diagnose import Diagnosis, diagnose
from diagnosis.fit.arrangement import Added, Arrangement, arrange
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import baseline_fit
from diagnosis.keep import Keep, computed
from diagnosis.threshold.simulation import Simulation
from diagnosis.threshold.thresholds import Thresholds
from pipeline import fingerprint
from pipeline.progress import Progress, SilentProgress
from pipeline.store import Store
from study.case.setup import Setup
from study.compare.run import Side
from study.diagnose.history import Errors
from study.diagnose.progress import phases
from study.diagnose.steps import step
from study.diagnose.thresholds import is_measured, layout, layout_key, limits_for, measured_limits

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True, eq=False)
class Round:
    """A diagnosis beside the case and the campaign that it is of.

    Parameters
    ----------
    setup
        Of the case, with the sensors of the campaign.
    campaign
        What was measured.
    diagnosis
        What was found.
    drawn
        The case without anything that was calibrated or added.
    keep
        Of this round.
    """

    setup: Setup
    campaign: Campaign
    diagnosis: Diagnosis[Arrangement]
    drawn: Refit
    keep: Keep

    @property
    def best(self) -> Refit | None:
        """What explains the measurements best; none if nothing does."""
        return next(iter(self.diagnosis.verdict.effects), None)

    def misfit(self, of: Refit) -> Misfit:
        """To the training data."""
        return Side(comparison=self.diagnosis.arrangement.train, prediction=of.fit.prediction).misfit


def diagnose_case(
    setup: Setup,
    campaign: Campaign,
    *,
    without: Sequence[str] = (),
    trials: int = 0,
    store: Store | None = None,
    progress: Progress | None = None,
    announce: Callable[[str], None] | None = None,
) -> Round:
    """Say what is missing from a case.

    Parameters
    ----------
    setup
        Of the case.
    campaign
        As read.
    without
        Kinds of effects that are left out, besides those of the case.
    trials
        Campaigns without any effect that give the thresholds of a layout for which none are shipped; 0 trusts the
        linear theory, with a margin.
    store
        Where steps are kept; nowhere by default.
    progress
        Shows what is being done.
    announce
        Called with a sentence if the trials are to be made.

    Raises
    ------
    CampaignError
        A sensor that does not fit the model, nothing held out, or a single repeat.
    EffectError
        An unknown kind, or an effect of one's own that fails.
    """
    setup = beside(setup, campaign)
    without = tuple(sorted({*setup.without, *without}))
    store, progress = store or Store(None), progress or SilentProgress()
    keep = remembered(kept(store, setup, campaign, without))
    thresholds = limits_for(setup, campaign, without)
    if thresholds is None and trials:
        thresholds = bootstrap(setup, campaign, without, trials, keep, store, progress, announce)
    with phases(progress, partial(holds, store, setup, campaign, without), len(setup.added) + 1) as shown:
        diagnosis = diagnose(
            campaign,
            setup.model,
            setup.accepted,
            setup.budget,
            added=setup.added,
            without=without,
            extra=setup.effects,
            thresholds=thresholds,
            keep=shown.watched(keep),
            report=shown.report,
        )
        drawn = keep("as drawn", lambda: as_drawn(diagnosis.arrangement, setup.model))
    return Round(setup=setup, campaign=campaign, diagnosis=diagnosis, drawn=drawn, keep=keep)


def bootstrap(
    setup: Setup,
    campaign: Campaign,
    without: Sequence[str],
    trials: int,
    keep: Keep,
    store: Store,
    progress: Progress,
    announce: Callable[[str], None] | None,
) -> Thresholds:
    """Thresholds of this layout, measured once."""

    def finer(model: Model) -> Catalogue:
        return replace(setup, model=model).candidates(campaign)

    known = setup.candidates(campaign, without)
    key = layout_key(layout(setup, campaign, known))
    if announce is not None and not is_measured(key, trials, store):
        announce(
            f"{trials} campaigns without any effect tell what chance does in this layout of tests; that is "
            "done once, an interrupted run goes on, and --trials 0 does without"
        )
    with progress.step("calibration"):
        arrangement = keep(
            "arrangement",
            lambda: arrange(campaign, setup.model, setup.accepted, setup.budget, added=setup.added, listed=finer),
        )
    added = {each.effect.name for each in setup.added}
    effects = [each for each in known.candidates if each.name not in added]
    return measured_limits(
        key, Simulation(campaign=campaign, arrangement=arrangement), effects, trials, store, progress
    )


def remembered(keep: Keep) -> Keep:
    """The same, and what was found or made once is in memory."""
    found: dict[str, Any] = {}

    def look(name: str, make: Callable[[], T]) -> T:
        if name not in found:
            found[name] = keep(name, make)
        value: T = found[name]
        return value

    return look


def beside(setup: Setup, campaign: Campaign) -> Setup:
    """A case with the sensors of a campaign, and its added effects as they are at the campaign's levels."""
    model = with_sensors(setup.model, campaign)
    refined = [with_sensors(finer, campaign) for finer in setup.budget.refined]
    setup = replace(setup, model=model, budget=replace(setup.budget, refined=refined))
    if not setup.added:
        return setup
    known = setup.candidates(campaign)
    return replace(setup, added=tuple(_at_levels(each, known) for each in setup.added))


def errors(of: Refit) -> Errors:
    """How far a fitted model is from the measurements."""
    return Errors(
        training=of.error,
        held_out=of.held_error,
        training_chi2=of.fit.chi2 / of.fit.n_number,
        held_out_chi2=of.held_chi2,
    )


def as_drawn(arrangement: Arrangement, model: Model) -> Refit:
    """A model as it is, tested like a fitted one."""
    prediction = arrangement.train.predict(model, arrangement.fit.prediction)
    residual = arrangement.train.residual(prediction)
    fit = replace(
        arrangement.fit,
        model=model,
        prediction=prediction,
        chi2=float(residual @ residual),
        residual=np.concatenate([residual, np.zeros(len(arrangement.fit.values))]),
    )
    return baseline_fit(replace(arrangement, fit=fit))


def kept(store: Store, setup: Setup, campaign: Campaign, without: Sequence[str]) -> Keep:
    """What looks steps up in a store, under a fingerprint of all that they depend on; thresholds only judge them."""
    if store.folder is None:
        return computed
    key = _key(setup, campaign, without)

    def keep(name: str, make: Callable[[], T]) -> T:
        found: T = store.run(step, key, name, make)
        return found

    return keep


def holds(store: Store, setup: Setup, campaign: Campaign, without: Sequence[str], name: str) -> bool:
    """Whether a step of a round is in a store, and sound."""
    return store.folder is not None and store.holds(step, _key(setup, campaign, without), name, dict)


def _key(setup: Setup, campaign: Campaign, without: Sequence[str]) -> str:
    inputs = {"setup": replace(setup, title=""), "campaign": campaign, "without": without}
    return fingerprint.key("diagnosis", _content(inputs), __name__)


def _content(inputs: dict[str, Any]) -> dict[str, Any]:
    """The folder of a campaign is no content: what was read from it is."""
    return {**inputs, "campaign": {name: value for name, value in vars(inputs["campaign"]).items() if name != "folder"}}


def _at_levels(added: Added, known: Catalogue) -> Added:
    try:
        return replace(added, effect=known.effect(added.effect.name))
    except EffectError:
        return added  # These tests say nothing about it, yet it is there.
