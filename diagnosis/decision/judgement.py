"""What was fitted and tested, judged; and judged once more where the weights themselves are in doubt."""

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
from diagnosis.keep import Keep
from diagnosis.localisation import Place, localise
from diagnosis.screening import Score
from diagnosis.threshold.thresholds import Thresholds

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True, eq=False)
class Known:
    """What every judgement goes by: candidates, their screening, and detection thresholds."""

    catalogue: Catalogue
    scores: Sequence[Score]
    thresholds: Thresholds


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """A verdict, and what it stands on: see `diagnosis.diagnose.Diagnosis`.

    Parameters
    ----------
    weighed
        Effect with which the model stands where the covariance was taken; "" for none.
    """

    arrangement: Arrangement
    before: Refit
    refits: tuple[Refit, ...]
    places: tuple[Place, ...]
    verdict: Verdict
    weighed: str = ""


def judge(
    arrangement: Arrangement, before: Refit, refits: Sequence[Refit], places: Sequence[Place], known: Known, keep: Keep
) -> Judgement:
    """Rank refits, and decide."""

    # What may be claimed stands before what may not.
    def rank(each: Refit) -> tuple[bool, float]:
        return not passes(arrangement, before, each, known.thresholds), -support(arrangement, before, each)

    ranked = sorted(refits, key=rank)
    verdict = decide(arrangement, known.catalogue, known.scores, before, ranked, places, known.thresholds, keep)
    return Judgement(
        arrangement=arrangement, before=before, refits=tuple(ranked), places=tuple(places), verdict=verdict
    )


def second_look(
    campaign: Campaign,
    first: Judgement,
    known: Known,
    listed: Callable[[Model], Catalogue],
    keep: Keep,
    told: Callable[[str], None],
) -> Judgement:
    """Judge anew with the weights that each effect would have if it were the one; the first judgement if none holds.

    An effect holds if, where the model with it stands, it is the best, and leaves no more than chance and a stand-in
    may. Several that hold, each by its own weights, cannot be told apart.

    Parameters
    ----------
    campaign
        Measurements.
    first
        By the weights of the model without any effect.
    known
        See `Known`.
    listed
        Effects of a finer model.
    keep, told
        See `diagnosis.diagnose.diagnose`; `told` takes what is being done.
    """
    held = []
    for each in first.refits:
        if each.effect is None or not passes(first.arrangement, first.before, each, known.thresholds):
            continue
        told(f"weights beside {each.name}")
        there = _within(keep, f"weighed beside {each.name}: ")
        beside = there("arrangement", partial(weigh_beside, campaign, first.arrangement, each.effect, each.fit, listed))
        before = there("held-out error", partial(baseline_fit, beside))
        refits = [there(f"refit of {other.name}", partial(refit_anew, beside, other)) for other in first.refits]
        found = judge(beside, before, refits, there("places", partial(localise, beside)), known, there)
        if found.verdict.effects and found.verdict.effects[0].name == each.name:
            held.append(replace(found, weighed=each.name))
    if not held:
        return first
    best = min(held, key=lambda found: found.verdict.effects[0].fit.chi2)
    names = {effect.name for found in held for effect in found.verdict.effects}
    effects = tuple(each for each in best.refits if each.name in names)
    finding = Finding.MISSING if len(effects) == 1 else Finding.AMBIGUOUS
    return replace(best, verdict=replace(best.verdict, finding=finding, effects=effects))


def _within(keep: Keep, where: str) -> Keep:
    """Names of steps beside others of the same name."""

    def kept(name: str, make: Callable[[], T]) -> T:
        return keep(f"{where}{name}", make)

    return kept
