"""One round of diagnosis: what is missing from a model, nothing, one of several, or nothing that is known."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Generic, TypeVar

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import Catalogue, Extra, list_campaign_effects
from diagnosis.candidate.effect import Effect
from diagnosis.decision.judgement import Known, judge, second_look
from diagnosis.decision.rules import worse_than_noise
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.fit.arrangement import Added, Arrangement, arrange
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.fit.problem import Problem, Refit
from diagnosis.fit.refit import baseline_fit, choose_finalists, is_lost, multistart_fits, quick_fit, refit, shortlist
from diagnosis.keep import Keep, computed
from diagnosis.localisation import Place, localise
from diagnosis.screening import Score, screen
from diagnosis.threshold.parametric_bootstrap import widen_intervals
from diagnosis.threshold.thresholds import NO_THRESHOLDS, Thresholds, compute_linear_thresholds
from fe.blas_threads import on_one_blas_thread

P = TypeVar("P", bound=Problem, covariant=True)

#: What is being done, and the share of the whole diagnosis that is done [-].
Report = Callable[[str, float], None]


@dataclass(frozen=True, kw_only=True)
class Shares:
    """Shares of a diagnosis that are done when its parts begin, after the calibration [-]."""

    screening: float
    fits: float
    tests: float
    places: float
    left: float
    intervals: float

    def between(self, first: str, last: str, share: float) -> float:
        """Part of the way from one beginning to another."""
        begin, end = getattr(self, first), getattr(self, last)
        return float(begin + share * (end - begin))


#: As timed on campaigns of the shipped beam; fits that find no way at once begin anew from many starts.
USUAL = Shares(screening=0.26, fits=0.41, tests=0.57, places=0.66, left=0.69, intervals=0.78)
LONG = Shares(screening=0.17, fits=0.26, tests=0.85, places=0.87, left=0.88, intervals=0.92)


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis(Generic[P]):
    """What one round found.

    Parameters
    ----------
    arrangement
        Measurements beside the model, and the calibration parameters (and added effects) fitted.
    catalogue
        Candidates, and what cannot be tested.
    scores
        Of all candidates, best first.
    before
        The model as it is, fitted and tested on the held-out data.
    refits
        The shortlist fitted in earnest, best first: what may be claimed before what may not, each by `support`.
    verdict
        In words, with numbers.
    places
        Where an unknown force would explain the residual, best first.
    thresholds
        Detection thresholds, where they decide.
    """

    arrangement: P
    catalogue: Catalogue
    scores: tuple[Score, ...]
    before: Refit
    refits: tuple[Refit, ...]
    verdict: Verdict
    places: tuple[Place, ...] = ()
    thresholds: Thresholds = NO_THRESHOLDS


def screen_and_refit(
    problem: Problem, effects: Sequence[Effect], keep: Keep, report: Report, shares: Shares
) -> tuple[list[Score], Refit, list[Refit]]:
    """Screen effects, fit the promising ones, test the best; the same for every kind of data.

    Parameters
    ----------
    problem
        Data beside a model, with its first fit.
    effects
        Candidates.
    keep, report
        As in `diagnose`.
    shares
        Of the round that are done when its parts begin.

    Returns
    -------
    Scores, best first; what the model without any further effect achieves; the refits.
    """
    lost = is_lost(problem, problem.fit)
    report("screening", shares.screening)

    def screened(done: int, of: int) -> None:
        report("screening", shares.between("screening", "fits", done / of))

    scores = keep("scores", lambda: screen(problem, effects, screened))
    before = keep("held-out error", lambda: baseline_fit(problem))
    fits, chosen = [], shortlist(scores, problem.effort, lost=lost)
    for number, score in enumerate(chosen):
        report(f"fit of {score.effect.name}", shares.between("fits", "tests", number / len(chosen)))
        fits.append((score, keep(f"fit of {score.effect.name}", partial(quick_fit, problem, score))))
    refits, last = [], choose_finalists(multistart_fits(problem, fits, keep), problem.effort)
    for number, (score, fit) in enumerate(last):
        report(f"test of {score.effect.name}", shares.between("tests", "places", number / len(last)))
        refits.append(keep(f"refit of {score.effect.name}", partial(refit, problem, score, fit)))
    return scores, before, refits


@on_one_blas_thread
def diagnose(
    campaign: Campaign,
    base: Model,
    calibration: Sequence[CalibrationParameter],
    budget: Budget,
    *,
    added: Sequence[Added] = (),
    without: Collection[str] = (),
    extra: Sequence[Extra] = (),
    thresholds: Thresholds | None = None,
    keep: Keep = computed,
    report: Report | None = None,
) -> Diagnosis[Arrangement]:
    """Say what is missing.

    Parameters
    ----------
    campaign
        Measurements, some of them held out.
    base
        The model without what was added.
    calibration
        What every fit calibrates.
    budget
        Numerical error of the model.
    added
        Effects that were found in earlier rounds; all are fitted again together.
    without, extra
        Kinds of effects to leave out, and effects of one's own, see `diagnosis.candidate.catalogue`.
    thresholds
        From a bootstrap of this layout; by the linear theory alone by default, with a margin.
    keep
        Looks up what a step gave before, or makes it.
    report
        Called with what is being done and the share of the round that is done.

    Raises
    ------
    CampaignError
        Nothing is held out, a single repeat, or a sensor that the model does not have.
    EffectError
        An unknown kind of effect, or one's own that is none.
    """
    told = report or (lambda _what, _share: None)
    names = {each.effect.name for each in added}
    listed = list_campaign_effects(campaign, base, without=without, extra=extra)
    listed = replace(listed, candidates=tuple(each for each in listed.candidates if each.name not in names))
    told("calibration", 0.0)
    every = partial(list_campaign_effects, campaign, extra=extra)
    arrangement = keep("arrangement", lambda: arrange(campaign, base, calibration, budget, added=added, listed=every))
    shares = LONG if is_lost(arrangement, arrangement.fit) else USUAL
    screened, before, refits = screen_and_refit(arrangement, listed.candidates, keep, told, shares)
    found = thresholds or compute_linear_thresholds(screened)
    told("unknown forces", shares.places)
    places = keep("places", lambda: localise(arrangement))
    told("what is left", shares.left)
    known = Known(catalogue=listed, scores=screened, thresholds=found)
    judged = judge(arrangement, before, refits, places, known, keep)
    if judged.verdict.finding is Finding.UNKNOWN and worse_than_noise(arrangement):
        judged = second_look(campaign, judged, known, every, keep, lambda what: told(what, shares.left))
    arrangement, before, verdict = judged.arrangement, judged.before, judged.verdict
    told("intervals", shares.intervals)
    best, everyone = (*verdict.effects, before)[0], [before, *judged.refits]
    where = judged.weighed or best.name
    wide = keep(f"intervals beside {where}", lambda: widen_intervals(campaign, arrangement, best, everyone))
    # By their names: which comes first is another matter with other thresholds.
    by_name = {each.name: each for each in wide}
    before, ranked = by_name[before.name], [by_name[each.name] for each in judged.refits]
    verdict = replace(verdict, before=before, effects=tuple(by_name[each.name] for each in verdict.effects))
    told("done", 1.0)
    return Diagnosis(
        arrangement=arrangement, catalogue=listed, scores=tuple(screened), before=before, refits=tuple(ranked),
        places=judged.places, thresholds=found, verdict=verdict,
    )  # fmt: skip
