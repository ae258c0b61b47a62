"""Rules that lead from refits to a verdict: those of docs/diagnose_method.md, whose numbers are those of the comments.

An effect passes if its gain of the training data, less the loss of the held-out data, exceeds the detection threshold:
an effect that fits noise worsens the held-out data by as much as it gains. Effects are ranked by the density of all
data, each with its own covariance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from correlation.noise.error_size import NO_ERROR, ErrorSize
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.decision.closeness import AbsentPeak, FarResonance, describe_beyond_priors, list_beyond_priors
from diagnosis.decision.confirmation import is_confirmed, takes_away
from diagnosis.decision.evidence import (
    DECISIVE,
    compute_birge_ratio,
    compute_log_density,
    compute_probabilities,
    compute_whole_gain,
    errs_on_held_out,
    exceeds_threshold,
    find_credible,
    passes,
)
from diagnosis.decision.fits import Fits
from diagnosis.decision.law_of_force import FittedLaw, compute_law_density, find_alternatives, has_other_laws
from diagnosis.decision.likeness import find_same
from diagnosis.decision.pair import Pair
from diagnosis.decision.pair_search import FoundPair, find_pair, find_pair_that_passes
from diagnosis.decision.stand_in import find_cause_beside
from diagnosis.decision.verdict import Finding, Verdict, compute_detectable_strengths
from diagnosis.decision.wording import describe_held_out_error, describe_law, describe_stand_in
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.screening import Score
from diagnosis.step import RunStep, remember_steps
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.unknown_force import UnknownForce, compute_excess_gain

#: |cos| between the changes by two effects above which the data cannot distinguish them [-].
SAME_DIRECTION = 0.99


@dataclass(frozen=True, kw_only=True, eq=False)
class Criteria:
    """Basis of a verdict: candidates, their scores, detection thresholds, and a far or absent resonance if any."""

    catalogue: Catalogue
    scores: Sequence[Score]
    thresholds: Thresholds
    far: FarResonance | AbsentPeak | None = None
    refit_by_own_covariance: Callable[[Comparison, Refit], Finalist] | None = None
    """Fits to the end an effect that is to be judged alone, see `Verdict.instead`; if None, this is left out."""


def judge(
    baseline: Finalist, finalists: Sequence[Finalist], places: Sequence[UnknownForce], by: Criteria, run_step: RunStep
) -> tuple[list[Finalist], Verdict]:
    """Rank finalists, those that pass the thresholds first, and decide.

    Parameters
    ----------
    baseline
        Fit and test of the model without a further effect.
    finalists
        Effects, each fitted with its own covariance.
    places
        Places where an unknown force would explain the residual of `baseline`, best first.
    by
        Candidates, scores and thresholds.
    run_step
        Looks up the stored result of a step, or computes it.
    """

    def rank(finalist: Finalist) -> tuple[bool, float]:
        return not passes(finalist.refit, by.thresholds), -compute_log_density(finalist.refit)

    def decide_on(ranked: Sequence[Finalist]) -> Verdict:
        size, beyond_priors = baseline.arrangement.model_error_size, list_beyond_priors(baseline.refit.fit)
        return decide(by, baseline.refit, ranked, places, run_step, size, beyond_priors)

    ranked = sorted(finalists, key=rank)
    verdict = decide_on(ranked)
    tried: set[str] = set()
    while by.refit_by_own_covariance is not None and verdict.instead is not None and verdict.instead.name not in tried:
        alone = verdict.instead
        tried.add(alone.name)
        refit_alone = partial(by.refit_by_own_covariance, alone.arrangement.train, alone.refit)
        own = run_step(f"{alone.name} of {alone.refit.strength:.6g} alone by its own covariance", refit_alone)
        best = min([*(item for item in ranked if item.name == alone.name), own], key=rank)
        ranked = sorted([*(item for item in ranked if item.name != alone.name), best], key=rank)
        verdict = decide_on(ranked)
    train = baseline.arrangement.train
    return ranked, find_untestable(verdict, bool(train.shares.any() or not train.observed.motion.any()))


def decide(
    by: Criteria,
    baseline: Refit,
    finalists: Sequence[Finalist],
    places: Sequence[UnknownForce],
    run_step: RunStep,
    model_error_size: ErrorSize = NO_ERROR,
    beyond_priors: Sequence[str] = (),
) -> Verdict:
    """Verdict by the rules, in their order.

    Parameters
    ----------
    by
        Candidates, scores and thresholds.
    baseline, places
        See `diagnosis.diagnose.Diagnosis`.
    finalists
        Finalists, best first.
    run_step
        Looks up the stored result of a step, or computes it.
    model_error_size
        Model error without an effect; if an effect passes, the model error of the fit with it is used.
    beyond_priors
        Calibration parameters of `baseline` beyond their priors.
    """
    nothing = Verdict(
        finding=Finding.NOTHING, effects=[], baseline=baseline, threshold=by.thresholds.gain,
        detectable=compute_detectable_strengths(by.scores, by.thresholds.gain),
        units={score.effect.name: score.effect.parameters[0].unit for score in by.scores},
        model_error_size=model_error_size,
    )  # fmt: skip
    if by.far is not None:  # rules 1 and 2
        return replace(nothing, finding=Finding.NOT_CLOSE, reason=by.far.sentence)
    fits = Fits(
        baseline=baseline, beyond_priors=beyond_priors, places=places,
        finalists={item.name: item for item in finalists}, catalogue=by.catalogue, thresholds=by.thresholds,
        directions={score.effect.name: score.direction for score in by.scores if score.size},
        run_step=remember_steps(run_step), refit_by_own_covariance=by.refit_by_own_covariance,
    )  # fmt: skip
    passed = [item for item in fits.refits if passes(item, by.thresholds)]
    verdict = _decide_with_effect(nothing, fits, passed) if passed else _decide_without_effect(nothing, fits)
    return replace(verdict, alike=_find_alike(by.scores, verdict.effects, finalists))


def _decide_without_effect(nothing: Verdict, fits: Fits) -> Verdict:
    """Verdict where no effect passes."""
    pair, instead = find_pair_that_passes(fits)
    size = nothing.model_error_size if pair is None else pair.first.arrangement.model_error_size
    nothing = replace(nothing, instead=instead, model_error_size=size)
    if size.is_far:  # rule 3
        sound = [item for item in fits.refits if _makes_model_sound(fits, item)]
        if not sound:
            return replace(nothing, finding=Finding.NOT_CLOSE)
        named = replace(_name_effects(nothing, fits, sound, None), finding=Finding.AMBIGUOUS, replaces_error=True)
        return replace(named, model_error_size=fits.arrangement_of(named.effects[0]).model_error_size)
    if pair is not None:  # rule 4
        return replace(_name_effects(nothing, fits, [], pair), finding=Finding.AMBIGUOUS)
    if _is_force_missing(fits):  # rule 5
        return _decide_unknown(nothing, fits, place=fits.places[0])
    result = _find_law_that_generalises(fits)
    if result is not None:  # rule 6
        return _name_law(nothing, fits, *result)
    if fits.beyond_priors:  # rule 7
        return _decide_unknown(nothing, fits)
    if errs_on_held_out(fits.baseline):  # rule 8
        return _decide_unknown(nothing, fits, reason=describe_held_out_error(fits.baseline))
    return nothing


def _decide_with_effect(nothing: Verdict, fits: Fits, passed: Sequence[Refit]) -> Verdict:
    """Verdict where some effects pass, the best first."""
    best = passed[0]
    law = fits.find_better_law(best)
    left = find_cause_beside(fits, best) if law is None else None
    pair, instead = FoundPair() if left is None else find_pair(fits, best, left)
    if law is None and (left is not None or has_other_laws(best.effect)):
        best, law = _find_law_of_another(fits, best, pair)
    arrangement = fits.arrangement_of(best) if pair is None or law is not None else pair.first.arrangement
    nothing = replace(nothing, instead=instead, model_error_size=arrangement.model_error_size)
    if nothing.model_error_size.is_far:  # rule 9
        return replace(nothing, finding=Finding.NOT_CLOSE)
    if law is not None:  # rule 10
        return _name_law(nothing, fits, best, law)
    if left is None or pair is not None:  # rules 11, 12, and 14 to 16
        return _name_effects(nothing, fits, passed, pair)
    if _is_force_missing(fits):  # rule 13
        return _decide_unknown(nothing, fits, fit=best, place=fits.places[0], nearest=best)
    return _decide_unknown(nothing, fits, fit=best, reason=describe_stand_in(best.name, left, fits.thresholds))


def _find_law_of_another(fits: Fits, best: Refit, pair: Pair | None) -> tuple[Refit, FittedLaw | None]:
    """Another effect and its law, if decisively more probable than the best effect and the pair; else the best."""
    result = fits.find_best_law([item for item in fits.refits if item.name != best.name and item.gain > 0])
    known = max(compute_log_density(item) for item in (best, *([] if pair is None else [pair.first.refit])))
    if result is None or compute_law_density(*result) <= known + DECISIVE:
        return best, None
    return result


def _name_effects(nothing: Verdict, fits: Fits, passed: Sequence[Refit], pair: Pair | None) -> Verdict:
    """Verdict that names the best effect and those that the data cannot distinguish from it; of a pair, the first.

    Parameters
    ----------
    nothing, fits
        Verdict without an effect, and the fits.
    passed
        Effects that pass alone, best first.
    pair
        The best effect or an alternative, and a second missing effect; None if one effect explains enough.
    """
    ranked = passed if pair is None else [item.refit for item in pair.ranked]
    # With a second effect in the model the directions differ.
    same = find_same(ranked, fits.directions) if pair is None else None
    weights = (compute_log_density, compute_whole_gain) if pair is None else (compute_log_density,)
    chances = compute_probabilities(ranked, same, weights)
    credible = find_credible(chances)  # rule 14
    effects = [ranked[number] for number in credible]
    best, alone = effects[0], fits.finalists[effects[0].name].refit
    laws = find_alternatives(fits.fit_other_laws(alone), DECISIVE)  # rule 11
    # Rule 15, except for the interval of the strength, which is computed later: see `Verdict.with_fits`.
    is_single = len(effects) == 1 and (pair is None or not pair.second_alternatives)
    is_sure = is_single and not laws and is_confirmed(best, alone, pair, fits.baseline)
    return replace(
        nothing, finding=Finding.MISSING if is_sure else Finding.AMBIGUOUS, effects=effects,
        probabilities=chances[credible].tolist(), laws=laws, pair=pair,
    )  # fmt: skip


def _name_law(nothing: Verdict, fits: Fits, refit: Refit, law: FittedLaw) -> Verdict:
    """Verdict that an unknown force at the place of an effect has another law."""
    place = next((item for item in fits.places if item.name == refit.place), None)
    reason = describe_law(refit, law, fits.baseline)
    return _decide_unknown(nothing, fits, fit=law.refit, place=place, nearest=refit, laws=[law], reason=reason)


def _decide_unknown(nothing: Verdict, fits: Fits, *, fit: Refit | None = None, **known: Any) -> Verdict:
    """Verdict that something unknown is missing; if parameters are beyond their priors, it reports only these.

    They are those of the fit with the passing effect, or with the law that was found; else of the baseline.
    """
    beyond_priors = fits.beyond_priors if fit is None else list_beyond_priors(fit.fit)
    if beyond_priors:
        reason = describe_beyond_priors(beyond_priors, "" if fit is None else fit.name)
        known = {"beyond_priors": beyond_priors, "reason": reason}
    return replace(nothing, finding=Finding.UNKNOWN, **known)


def _makes_model_sound(fits: Fits, refit: Refit) -> bool:
    """Whether an effect that the held-out data confirm removes a model error too large for a sound model."""
    left = max(refit.reduced_chi2_by_noise, refit.held_out_reduced_chi2_by_noise)
    is_confirmed_by_data = refit.gain > 0 and refit.held_out_gain >= DECISIVE and not refit.worsens
    is_sound = left <= UNEXPLAINED_CHI2 and not fits.arrangement_of(refit).model_error_size.is_far
    return is_confirmed_by_data and is_sound and not takes_away(refit)


def _is_force_missing(fits: Fits) -> bool:
    """Whether the gain of an unknown force, less that of effects that the held-out data contradict, exceeds chance."""
    if not fits.places:
        return False
    refuted = max((item.gain for item in fits.refits if item.held_out_gain < 0), default=0.0)
    left = compute_birge_ratio(fits.baseline, fits.places[0].gain)
    return compute_excess_gain(fits.places[0]) - max(refuted, 0.0) > fits.thresholds.misfit * left


def _find_law_that_generalises(fits: Fits) -> tuple[Refit, FittedLaw] | None:
    """The best effect with a gain beyond chance, and another law with which the held-out error falls; else None."""
    refit = next((item for item in fits.refits if exceeds_threshold(item, fits.thresholds)), None)
    law = None if refit is None else fits.find_better_law(refit)
    if refit is None or law is None or refit.held_out_gain + law.held_out_gain <= 0:
        return None
    return (refit, law) if law.refit.held_out_error < fits.baseline.held_out_error else None


def find_untestable(verdict: Verdict, is_seen: bool) -> Verdict:
    """The verdict, or `Finding.NOT_TESTABLE` if no effect could have been detected.

    "Nothing is missing" is meaningful only if an effect would have been visible. If no motion exceeds its scatter, a
    large deviation is noise.

    Parameters
    ----------
    verdict
        Verdict by the rules.
    is_seen
        Whether any motion exceeds its scatter.
    """
    why = ""
    detectable = np.array([*verdict.detectable.values()])
    if not is_seen and (verdict.finding in {Finding.NOTHING, Finding.NOT_CLOSE} or verdict.beyond_priors):
        why = "no motion exceeds its scatter"
    elif verdict.finding is Finding.NOTHING and len(detectable) and not np.isfinite(detectable).any():
        why = "they would not show any effect at any strength within its bounds"
    if not why:
        return verdict
    reason = f"These measurements cannot show whether an effect is missing: {why}."
    return replace(verdict, finding=Finding.NOT_TESTABLE, reason=reason, beyond_priors=())


def _find_alike(scores: Sequence[Score], effects: Sequence[Refit], finalists: Sequence[Finalist]) -> list[str]:
    """Effects with the direction of the best one that were not fitted to the end, if all finalists are named."""
    directions = {score.effect.name: score.direction for score in scores}
    best = directions.get(effects[0].name) if effects else None
    if best is None or len(effects) < max(2, len(finalists)):
        return []
    fitted = {item.name for item in finalists}
    return [
        name for name, item in directions.items() if name not in fitted and abs(float(item @ best)) > SAME_DIRECTION
    ]
