"""Judgement of fitted and tested effects, repeated with other weights where the covariance itself is in doubt."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.decision.rules import decide, passes, support
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.fit.arrangement import Arrangement, weigh_beside
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import baseline_fit, refit_anew
from diagnosis.localisation import Place, localise
from diagnosis.screening import Score
from diagnosis.step import RunStep
from diagnosis.threshold.detection_threshold import Thresholds

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True, eq=False)
class Criteria:
    """Basis of every judgement: candidates, their scores, and detection thresholds."""

    catalogue: Catalogue
    scores: Sequence[Score]
    thresholds: Thresholds


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """A verdict and its basis, see `diagnosis.diagnose.Diagnosis`.

    Parameters
    ----------
    weighed
        Name of the effect with which the covariance was computed; "" for none.
    """

    arrangement: Arrangement
    before: Refit
    refits: tuple[Refit, ...]
    places: tuple[Place, ...]
    verdict: Verdict
    weighed: str = ""


def judge(
    arrangement: Arrangement,
    before: Refit,
    refits: Sequence[Refit],
    places: Sequence[Place],
    by: Criteria,
    run_step: RunStep,
) -> Judgement:
    """Rank refits and decide: effects that pass the thresholds come first."""

    def rank(refit: Refit) -> tuple[bool, float]:
        return not passes(arrangement, before, refit, by.thresholds), -support(arrangement, before, refit)

    ranked = sorted(refits, key=rank)
    verdict = decide(arrangement, by.catalogue, by.scores, before, ranked, places, by.thresholds, run_step)
    return Judgement(
        arrangement=arrangement, before=before, refits=tuple(ranked), places=tuple(places), verdict=verdict
    )


def second_look(
    campaign: Campaign,
    first: Judgement,
    criteria: Criteria,
    catalogue_of: Callable[[Model], Catalogue],
    run_step: RunStep,
    report: Callable[[str], None],
) -> Judgement:
    """Judge again with the weights of the model that has each effect in turn; the first judgement if none is confirmed.

    An effect is confirmed if it is the best by the weights of the model with it, and the rest beside it is within
    chance. Several effects that are confirmed, each by its own weights, cannot be told apart.

    Parameters
    ----------
    campaign
        Measurements.
    first
        Judgement by the weights of the model without any effect.
    criteria
        Candidates, scores and thresholds.
    catalogue_of
        Effects of a finer model.
    run_step, report
        As in `diagnosis.diagnose.diagnose`; `report` takes the name of the step alone.
    """
    confirmed = []
    for refit in first.refits:
        if refit.effect is None or not passes(first.arrangement, first.before, refit, criteria.thresholds):
            continue
        report(f"weights beside {refit.name}")
        inner = _with_prefix(run_step, f"weighed beside {refit.name}: ")
        weigh = partial(weigh_beside, campaign, first.arrangement, refit.effect, refit.fit, catalogue_of)
        beside = inner("arrangement", weigh)
        before = inner("held-out error", partial(baseline_fit, beside))
        refits = [inner(f"refit of {other.name}", partial(refit_anew, beside, other)) for other in first.refits]
        judgement = judge(beside, before, refits, inner("places", partial(localise, beside)), criteria, inner)
        if judgement.verdict.effects and judgement.verdict.effects[0].name == refit.name:
            confirmed.append(replace(judgement, weighed=refit.name))
    if not confirmed:
        return first
    best = min(confirmed, key=lambda judgement: judgement.verdict.effects[0].fit.chi2)
    names = {effect.name for judgement in confirmed for effect in judgement.verdict.effects}
    effects = tuple(refit for refit in best.refits if refit.name in names)
    finding = Finding.MISSING if len(effects) == 1 else Finding.AMBIGUOUS
    return replace(best, verdict=replace(best.verdict, finding=finding, effects=effects))


def _with_prefix(run_step: RunStep, prefix: str) -> RunStep:
    """The same store, with a prefix to the names of steps."""

    def keep_prefixed(name: str, make: Callable[[], T]) -> T:
        return run_step(f"{prefix}{name}", make)

    return keep_prefixed
