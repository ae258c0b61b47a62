"""One round of diagnosis: identify the effect that is missing from a model, if any, or find that it is unknown."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter
from typing import Generic, NamedTuple, TypeAlias, TypeVar

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from correlation.noise.error_size import ErrorSize
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import Catalogue, Extra, list_campaign_effects
from diagnosis.candidate.effect import Effect
from diagnosis.decision.closeness import (
    AbsentPeak,
    FarResonance,
    find_absent_peak,
    find_far_resonance,
)
from diagnosis.decision.rules import Criteria, judge
from diagnosis.decision.stand_in import MIN_SHARE_KNOWN
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.alike_fit import fit_alike
from diagnosis.fit.arrangement import Arrangement, arrange, expect_usual_error
from diagnosis.fit.calibration import Fit
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.fit.controlled_start import find_controlled_starts
from diagnosis.fit.far_start import list_far_starts
from diagnosis.fit.finalist import Finalist, refit_by_own_covariance, refit_each_by_own_covariance
from diagnosis.fit.fit_parameter import Values
from diagnosis.fit.problem import UNEXPLAINED_CHI2, FitProblem, Refit
from diagnosis.fit.refit import (
    choose_finalists,
    fit_from_starts,
    fit_quickly,
    is_poor_fit,
    make_baseline_refit,
    refit,
    shortlist,
)
from diagnosis.model_error_share import rank_by_best_covariance
from diagnosis.screening import Score, screen
from diagnosis.step import RunStep, compute_step
from diagnosis.threshold.detection_threshold import (
    LEAST_UNKNOWN_FORCE_GAIN,
    LINEAR_MARGIN,
    NO_THRESHOLDS,
    Thresholds,
    compute_linear_thresholds,
)
from diagnosis.threshold.parametric_bootstrap import widen_intervals
from diagnosis.unknown_force import UnknownForce, compute_excess_gain, find_unknown_forces
from diagnosis.unnamed_place import find_better_elsewhere, list_effects_elsewhere
from fe.blas_threads import on_one_blas_thread
from fe.dense_modes import compute_dense_modes

#: Effects with start values of their fits.
Starts: TypeAlias = Sequence[tuple[Effect, Values]]
P = TypeVar("P", bound=FitProblem, covariant=True)

#: Called with the name of a step and the share of the whole diagnosis that is done [-].
Report = Callable[[str, float], None]


@dataclass(frozen=True, kw_only=True)
class ProgressFractions:
    """Fraction of a diagnosis that is completed at the begin of each of its parts, after the calibration [-]."""

    screening: float
    fits: float
    tests: float
    covariances: float
    explanation: float
    intervals: float

    def between(self, first: str, last: str, share: float) -> float:
        """Fraction that is completed at `share` of the way from the begin of one part to that of another [-]."""
        begin, end = getattr(self, first), getattr(self, last)
        return float(begin + share * (end - begin))


#: Timed on campaigns of the shipped beam: usual ones, and those whose fits need many starts.
USUAL_PROGRESS = ProgressFractions(
    screening=0.26, fits=0.41, tests=0.57, covariances=0.62, explanation=0.83, intervals=0.88
)
LONG_PROGRESS = ProgressFractions(
    screening=0.17, fits=0.26, tests=0.8, covariances=0.83, explanation=0.91, intervals=0.94
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis(Generic[P]):
    """Result of one round.

    Parameters
    ----------
    arrangement
        Measurements and model, with the fit of the calibration parameters and the added effects.
    catalogue
        Candidates, and effects that cannot be tested.
    scores
        Scores of all candidates, best first.
    baseline
        Fit and held-out test of the model without a further effect.
    refits
        Thorough fits of the finalists: effects that pass the thresholds first, then by decreasing density of all data.
    verdict
        Verdict.
    places
        Places where an unknown force would explain the residual, best first.
    thresholds
        Detection thresholds; zero if the held-out error decides.
    """

    arrangement: P
    catalogue: Catalogue
    scores: tuple[Score, ...]
    baseline: Refit
    refits: tuple[Refit, ...]
    verdict: Verdict
    places: tuple[UnknownForce, ...] = ()
    thresholds: Thresholds = NO_THRESHOLDS


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedModel:
    """A calibrated model with its measurements, before the screening of effects.

    Parameters
    ----------
    arrangement
        Measurements and model, with the fit of the calibration parameters and the added effects.
    screening
        Arrangement with which effects are screened and fitted.
    catalogue
        Candidates, and effects that cannot be tested.
    far
        A measured resonance that is far from those of the model, or a predicted one that is absent, if there is one.
    effects
        Effects to screen; none if `far` is set.
    starts
        Effects with additional start values of their fits.
    progress
        Fractions of the round that are completed at the begin of its parts.
    """

    arrangement: Arrangement
    screening: Arrangement
    catalogue: Catalogue
    far: FarResonance | AbsentPeak | None
    effects: Sequence[Effect]
    starts: Starts
    progress: ProgressFractions


class EffectChoice(NamedTuple):
    """Choice of the effects that are fitted."""

    rank: Callable[[Sequence[Score]], Sequence[Score]] = list
    """Order and gains of the scores for the selection of quick fits."""
    cost: Callable[[Fit], float] = attrgetter("chi2")
    """Cost of a quick fit for the selection of thorough fits."""
    list_starts: Callable[[Sequence[Score], Fit], Starts] = lambda _scores, _best: ()
    """Effects with additional start values of their fits, from the scores and the best quick fit."""


def screen_and_refit(
    problem: FitProblem,
    effects: Sequence[Effect],
    run_step: RunStep,
    report: Report,
    progress: ProgressFractions,
    choice: EffectChoice | None = None,
) -> tuple[list[Score], Refit, list[Refit]]:
    """Screen effects, fit the promising ones and test the best, for any kind of data.

    Parameters
    ----------
    problem
        Data and model, with its first fit.
    effects
        Candidates.
    run_step, report
        As in `diagnose`.
    progress
        Fractions of the round that are completed at the begin of its parts.
    choice
        Choice of the effects that are fitted; in the order of their scores by default.

    Returns
    -------
    Scores, best first; the test of the model without a further effect; the refits.
    """
    choice = choice or EffectChoice()
    scores = screen_effects(problem, effects, run_step, report, progress)
    baseline = run_step("held-out error", lambda: make_baseline_refit(problem))
    ranked = run_step("ranked scores", lambda: list(choice.rank(scores)))
    by_name = {score.effect.name: score for score in scores}
    listed = shortlist(ranked, problem.selection, is_poor=is_poor_fit(problem))
    fits, chosen = [], [by_name[item.effect.name] for item in listed]
    for number, score in enumerate(chosen):
        report(f"fit of {score.effect.name}", progress.between("fits", "tests", number / len(chosen)))
        fits.append((score, run_step(f"fit of {score.effect.name}", partial(fit_quickly, problem, score))))
    costs = [run_step(f"cost of {score.effect.name}", partial(choice.cost, fit)) for score, fit in fits]
    best = fits[costs.index(min(costs))][1] if fits else problem.fit
    report("fits from other starts", progress.tests)
    starts = run_step("other starts", lambda: list(choice.list_starts(scores, best)))
    from_starts = fit_from_starts(problem, scores, fits, starts, run_step)
    from_starts = fit_alike(problem, scores, from_starts, run_step)
    known = {id(fit): cost for (_, fit), cost in zip(fits, costs, strict=True)}
    costs = [
        known[id(fit)]
        if id(fit) in known
        else run_step(f"cost of {name} from another start", partial(choice.cost, fit))
        for name, fit in ((score.effect.name, fit) for score, fit in from_starts)
    ]
    refits, last = [], choose_finalists(from_starts, costs, problem.selection)
    for number, (score, fit) in enumerate(last):
        report(f"test of {score.effect.name}", progress.between("tests", "covariances", number / len(last)))
        refits.append(run_step(f"refit of {score.effect.name}", partial(refit, problem, score, fit)))
    return scores, baseline, refits


def screen_effects(
    problem: FitProblem, effects: Sequence[Effect], run_step: RunStep, report: Report, progress: ProgressFractions
) -> list[Score]:
    """Scores of effects, best first; parameters as for `screen_and_refit`."""
    report("screening", progress.screening)

    def report_screening(done: int, total: int) -> None:
        report("screening", progress.between("screening", "fits", done / total))

    return run_step("scores", lambda: screen(problem, effects, report_screening))


@on_one_blas_thread
def calibrate_model(
    campaign: Campaign,
    base: Model,
    calibration: Sequence[CalibrationParameter],
    budget: Budget,
    *,
    added: Sequence[AddedEffect],
    without: Collection[str],
    extra: Sequence[Extra],
    run_step: RunStep,
    report: Report,
) -> CalibratedModel:
    """Calibrate a model, the first part of a diagnosis; parameters as for `diagnose`."""
    base = _with_basis(base)
    # Already fitted effects are no candidates: added effects, and parameters of joints that the case accepts.
    names = {item.effect.name for item in added} | {item.name for item in calibration}
    catalogue = list_campaign_effects(campaign, base, without=without, extra=extra)
    catalogue = replace(catalogue, candidates=tuple(item for item in catalogue.candidates if item.name not in names))
    report("calibration", 0.0)
    find_catalogue = partial(list_campaign_effects, campaign, extra=extra)
    arrangement = run_step(
        "arrangement", lambda: arrange(campaign, base, calibration, budget, added=added, catalogue_of=find_catalogue)
    )
    screening = _choose_screening(arrangement, run_step)
    progress = LONG_PROGRESS if is_poor_fit(screening) else USUAL_PROGRESS
    far = _find_far(arrangement)
    report("response control", progress.screening / 2)
    effects = catalogue.candidates if far is None else ()
    arrangement, screening, starts = _begin(arrangement, screening, effects, run_step)
    return CalibratedModel(
        arrangement=arrangement, screening=screening, catalogue=catalogue, far=far, effects=effects, starts=starts,
        progress=progress,
    )  # fmt: skip


@on_one_blas_thread
def diagnose(
    campaign: Campaign,
    base: Model,
    calibration: Sequence[CalibrationParameter],
    budget: Budget,
    *,
    added: Sequence[AddedEffect] = (),
    without: Collection[str] = (),
    extra: Sequence[Extra] = (),
    thresholds: Thresholds | None = None,
    run_step: RunStep = compute_step,
    report: Report | None = None,
) -> Diagnosis[Arrangement]:
    """Identify the effect that is missing from a model: one round.

    Parameters
    ----------
    campaign
        Measurements, some of them held out.
    base
        Model without the added effects.
    calibration
        Calibration parameters, which every fit sets.
    budget
        Numerical error of the model.
    added
        Effects added in earlier rounds; all are fitted again together.
    without, extra
        Kinds of effects to leave out, and the user's own effects, see `diagnosis.candidate.catalogue`.
    thresholds
        Detection thresholds from a bootstrap of this layout; those of the linear theory with a margin by default.
    run_step, report
        Looks up the stored result of a step, or computes it; called with its name and the completed share [-].

    Raises
    ------
    CampaignError
        Nothing is held out, there is a single repeat of unknown noise, or the model lacks a sensor.
    EffectError
        An unknown kind of effect, or an invalid effect of the user's own.
    """
    report = report or (lambda _step, _share: None)
    result = calibrate_model(
        campaign, base, calibration, budget, added=added, without=without, extra=extra, run_step=run_step, report=report
    )
    arrangement, screening, progress = result.arrangement, result.screening, result.progress
    report("unknown forces", 0.75 * progress.screening)
    places = run_step("places", lambda: find_unknown_forces(arrangement))
    list_starts = partial(_list_starts, screening, result.starts, places)
    choice = EffectChoice(partial(rank_by_best_covariance, screening), screening.cost_with_error_left, list_starts)
    scores, baseline, refits = screen_and_refit(screening, result.effects, run_step, report, progress, choice)
    linear = compute_linear_thresholds(scores)
    thresholds = thresholds or linear
    report("covariance of each finalist", progress.covariances)
    baseline = baseline if screening is arrangement else make_baseline_refit(arrangement)
    find_catalogue = partial(list_campaign_effects, campaign, extra=extra)
    own = partial(refit_by_own_covariance, campaign, arrangement, baseline, find_catalogue)
    # An effect below the threshold is not named regardless of its other gain, unless the model is far off without it.
    chance = -float("inf") if arrangement.model_error_size.is_far else min(linear.gain / LINEAR_MARGIN, thresholds.gain)
    by_own = partial(own, screening.train, chance=chance)
    finalists = refit_each_by_own_covariance(
        screening, refits, by_own, lambda name, make: run_step(f"{name} beyond {chance:.6g}", make)
    )
    without_effect = Finalist(refit=baseline, arrangement=arrangement)
    report("residual", progress.explanation)
    criteria = Criteria(
        catalogue=result.catalogue, scores=scores, thresholds=thresholds, far=result.far, refit_by_own_covariance=own
    )
    list_elsewhere = partial(list_effects_elsewhere, campaign, screening, without, extra)
    scores, finalists, verdict = _judge(
        screening, without_effect, finalists, places, criteria, list_elsewhere, run_step
    )
    report("intervals", progress.intervals)
    baseline, refits, verdict = _widen(campaign, without_effect, finalists, verdict, run_step)
    report("done", 1.0)
    return Diagnosis(
        arrangement=arrangement, catalogue=result.catalogue, scores=tuple(scores), baseline=baseline,
        refits=tuple(refits), places=tuple(places), thresholds=thresholds, verdict=verdict,
    )  # fmt: skip


def _judge(
    screening: Arrangement,
    without_effect: Finalist,
    finalists: Sequence[Finalist],
    places: Sequence[UnknownForce],
    by: Criteria,
    list_elsewhere: Callable[[], list[Effect]],
    run_step: RunStep,
) -> tuple[list[Score], list[Finalist], Verdict]:
    """Scores, finalists and verdict; effects at unnamed places are added if no single effect explains enough."""
    ranked, verdict = judge(without_effect, finalists, places, by, run_step)
    leaves_much = any(item.reduced_chi2_by_noise > UNEXPLAINED_CHI2 for item in verdict.effects[:1])
    if verdict.pair is None and verdict.finding is not Finding.UNKNOWN and not leaves_much:
        return [*by.scores], ranked, verdict
    effects = run_step("effects elsewhere", list_elsewhere)
    elsewhere, better = find_better_elsewhere(screening, effects, without_effect, ranked, verdict, by, run_step)
    if not better:
        return [*by.scores], ranked, verdict
    scores = sorted([*by.scores, *elsewhere], key=lambda score: -score.gain)
    return scores, *judge(without_effect, [*ranked, *better], places, replace(by, scores=scores), run_step)


def _find_far(arrangement: Arrangement) -> FarResonance | AbsentPeak | None:
    """A measured resonance that is far from those of the model, or a predicted one that is absent."""
    seen, fit = arrangement.train.observed, arrangement.fit
    return find_far_resonance(seen, fit.model) or find_absent_peak(seen, fit.prediction.value)


def _with_basis(model: Model) -> Model:
    """The model with its modes without joints as a basis: fits change it little, and these modes serve all of them."""
    modes = compute_dense_modes(model.system.mass, model.system.stiffness)
    return model.with_system(basis=modes.shapes)


def _widen(
    campaign: Campaign, without_effect: Finalist, finalists: Sequence[Finalist], verdict: Verdict, run_step: RunStep
) -> tuple[Refit, list[Refit], Verdict]:
    """The fits without an effect and with each, and the verdict, with intervals from the parametric bootstrap."""
    pair, alone = verdict.pair, [without_effect, *finalists]
    firsts, seconds = ([], []) if pair is None else (pair.ranked, [pair.second, *pair.second_alternatives])
    listed = [*alone, *firsts, *seconds]
    # If there are two effects, the verdict refers to the fits with both.
    judged = slice(len(alone) if firsts else 0, len(alone) + len(firsts))
    best = {item.name: item for item in listed[judged]}[(*verdict.effects, without_effect.refit)[0].name]
    name = f"intervals beside {best.refit.label} of {', '.join(item.refit.label for item in listed)}"
    fits = run_step(name, partial(widen_intervals, campaign, best, listed))
    if pair is not None:
        widened = [replace(item, refit=fit) for item, fit in zip(listed, fits, strict=True)]
        (first, *others), (second, *other_seconds) = widened[judged], widened[judged.stop :]
        pair = replace(
            pair, first=first, second=second, alternatives=tuple(others), second_alternatives=tuple(other_seconds)
        )
    by_name = {item.name: item for item in fits[judged]}
    effects = [by_name[item.name] for item in verdict.effects]
    return fits[0], fits[1 : len(alone)], verdict.with_fits(fits[0], effects, pair)


def _begin(
    arrangement: Arrangement, screening: Arrangement, effects: Sequence[Effect], run_step: RunStep
) -> tuple[Arrangement, Arrangement, Starts]:
    """Arrangement, arrangement for the screening, and additional starts of fits if the latter fits poorly."""
    if not effects or not is_poor_fit(screening):
        return arrangement, screening, []
    starts = run_step("starts under response control", partial(_find_starts, arrangement, effects))
    arrangement = run_step("branches", partial(_downweight_other_branch, arrangement, starts))
    return arrangement, _choose_screening(arrangement, run_step, "usual model error, branches apart"), starts


def _list_starts(
    screening: Arrangement,
    controlled: Starts,
    places: Sequence[UnknownForce],
    scores: Sequence[Score],
    best: Fit,
) -> Starts:
    """Starts under response control, and far ones if no effect near the fit explains the data.

    This is the case if an unknown force explains much, or if the best quick fit has a model error of unusual size or
    calibration parameters beyond their priors. The thresholds of the linear theory are used in any case, so that stored
    fits are valid for all thresholds.
    """
    gain = screening.fit.chi2 - best.chi2
    thresholds, unexplained = compute_linear_thresholds(scores), compute_excess_gain(places[0]) if places else 0.0
    is_missing = unexplained > max(LEAST_UNKNOWN_FORCE_GAIN, thresholds.misfit, gain / MIN_SHARE_KNOWN)
    is_usual = screening.find_error_left(best).is_within(ErrorSize.usual(screening.budget.model))
    if is_usual and not is_missing and not best.is_beyond_priors:
        return controlled
    return [*controlled, *list_far_starts(screening, [score.effect for score in scores])]


def _find_starts(arrangement: Arrangement, effects: Sequence[Effect]) -> Starts:
    """Effects that explain most under response control, best first, with their fitted values."""
    result = find_controlled_starts(arrangement, arrangement.train, effects, arrangement.budget.model)
    return result[: arrangement.selection.n_finalist]


def _downweight_other_branch(arrangement: Arrangement, starts: Starts) -> Arrangement:
    """The same with negligible weight for points at which the best start is on another branch than the structure."""
    if not starts:
        return arrangement
    effect, values = starts[0]
    return arrangement.downweight_other_branch(arrangement.unknowns([effect]).compose(values))


def _choose_screening(arrangement: Arrangement, run_step: RunStep, name: str = "usual model error") -> Arrangement:
    """Arrangement for the screening and fits of effects: with usual model error if the estimated one is too large."""
    if not arrangement.model_error_size.is_far:
        return arrangement
    return run_step(name, lambda: expect_usual_error(arrangement))
