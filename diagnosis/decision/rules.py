r"""Rules that lead from refits to a verdict.

An effect passes if the training data gain more by it than the detection threshold, less what the held-out data lose: an
effect that fits noise makes these worse by as much as it gains. Effects are ranked by the density of all data, each by
its own covariance. Effects so close to the best that the data cannot distinguish them are named with it. It is named
without doubt only if the held-out data confirm it. Then other laws are fitted in place of that of the best one: a force
that has one is another force. And the remaining residual is examined. If another effect explains a good part of it, and
both together leave no unknown force, both are missing; at one place both together are one force whose law is not known.
If an unknown force explains a good part of the gain of the best one, that one only stands in for it, and none of the
known effects is the cause. The same holds if a linear effect leaves an unknown force that is no known effect: a force
that varies with the amplitude has a linear part, and what takes up this part may gain a great deal. An effect that
varies with the amplitude as well is the known one that is nearest.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from correlation.noise.error_size import NO_ERROR, ErrorSize
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.decision.closeness import AbsentPeak, FarResonance, list_held_back, tell_held_back
from diagnosis.decision.evidence import compute_log_density, errs_on_held_out, passes
from diagnosis.decision.law_of_force import FittedLaw
from diagnosis.decision.likelihood_ratio import LikelihoodRatioTest, place_of
from diagnosis.decision.naming import apply_test
from diagnosis.decision.residual_explanation import ResidualExplanation
from diagnosis.decision.verdict import Finding, Verdict, held_out_fall, smallest_detectable
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.problem import UNEXPLAINED, Refit
from diagnosis.screening import Score
from diagnosis.step import RunStep
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.unknown_force import UnknownForce, compute_excess_gain
from geometry.plain_number import plain

#: |cos| of the changes by two effects from which on the data cannot tell them apart [-].
SAME_DIRECTION = 0.99


@dataclass(frozen=True, kw_only=True, eq=False)
class Criteria:
    """Basis of every judgement: candidates, their scores, detection thresholds, and a resonance that is far off."""

    catalogue: Catalogue
    scores: Sequence[Score]
    thresholds: Thresholds
    far: FarResonance | AbsentPeak | None = None
    refit_by_own_covariance: Callable[[Comparison, Refit], Finalist] | None = None
    """Fits an effect that turns out to explain most to the end; without it such a one is not judged."""


def judge(
    baseline: Finalist, finalists: Sequence[Finalist], places: Sequence[UnknownForce], by: Criteria, run_step: RunStep
) -> tuple[list[Finalist], Verdict]:
    """Rank finalists, those that pass the thresholds first, and decide.

    Parameters
    ----------
    baseline
        Fit and test of the model without a further effect.
    finalists
        Effects by their own covariance.
    places
        Places where an unknown force would explain the residual of `baseline`, best first.
    by
        Candidates, scores and thresholds.
    run_step
        Looks up the stored result of a step, or computes it.
    """

    def rank(finalist: Finalist) -> tuple[bool, float]:
        return not passes(finalist.refit, by.thresholds), -compute_log_density(finalist.refit)

    def judged(ranked: Sequence[Finalist]) -> Verdict:
        size, held_back = baseline.arrangement.model_error_size, list_held_back(baseline.refit.fit)
        return decide(by, baseline.refit, ranked, places, run_step, size, held_back)

    ranked = sorted(finalists, key=rank)
    verdict = judged(ranked)
    tried: set[str] = set()
    while by.refit_by_own_covariance is not None and verdict.instead is not None and verdict.instead.name not in tried:
        alone = verdict.instead
        tried.add(alone.name)
        refit_alone = partial(by.refit_by_own_covariance, alone.arrangement.train, alone.refit)
        own = run_step(f"{alone.name} of {alone.refit.strength:.6g} alone by its own covariance", refit_alone)
        best = min([*(each for each in ranked if each.name == alone.name), own], key=rank)
        ranked = sorted([*(each for each in ranked if each.name != alone.name), best], key=rank)
        verdict = judged(ranked)
    train = baseline.arrangement.train
    return ranked, find_untestable(verdict, bool(train.shares.any() or not train.observed.motion.any()))


def decide(
    by: Criteria,
    baseline: Refit,
    finalists: Sequence[Finalist],
    places: Sequence[UnknownForce],
    run_step: RunStep,
    model_error_size: ErrorSize = NO_ERROR,
    held_back: Sequence[str] = (),
) -> Verdict:
    """Verdict.

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
        Model error that is left without an effect; where one passes, that which is left beside it counts.
    held_back
        Calibration parameters of `baseline` that are as far as their priors let a fit go.
    """
    thresholds, far = by.thresholds, by.far
    refuted = max((each.refit.gain for each in finalists if each.refit.held_out_gain < 0), default=0.0)
    passed = [each for each in finalists if passes(each.refit, thresholds)]
    by_name, refits = {each.name: each for each in finalists}, [each.refit for each in finalists]
    test = LikelihoodRatioTest(by_name, by.catalogue, places, thresholds, run_step, baseline, max(refuted, 0.0))
    finding, effects = apply_test(test, refits)
    model_error_size, reason = passed[0].arrangement.model_error_size if passed else model_error_size, ""
    if not passed and test.finds_two(refits):
        finding, effects = Finding.AMBIGUOUS, test.choose([])
    if test.pair is not None:
        model_error_size = test.pair.first.arrangement.model_error_size
    if model_error_size.is_far or far is not None:
        finding, effects = Finding.NOT_CLOSE, []
        reason = "" if far is None else far.sentence
    if finding is Finding.NOTHING and test.generalises_by_another_law(refits):
        finding = Finding.UNKNOWN
    laws = test.find_alternative_laws(effects[0]) if effects else []
    if finding is Finding.MISSING and (laws or not test.is_confirmed(effects[0])):
        finding = Finding.AMBIGUOUS
    if finding is Finding.NOTHING and held_back:
        # What a parameter has taken up as far as its prior lets it go may be an effect.
        finding = Finding.UNKNOWN
    if finding is Finding.NOTHING and errs_on_held_out(baseline):
        finding, reason = Finding.UNKNOWN, _tell_held_out_error(baseline)
    has_place = finding is Finding.UNKNOWN and not test.laws and test.is_unexplained()
    place, nearest = places[0] if has_place else None, passed[0].refit if has_place and passed else None
    if finding is Finding.UNKNOWN and test.laws:
        ((name, law),) = test.laws.items()
        place = next((each for each in places if each.name == place_of(name)), None)
        nearest = next(each.refit for each in finalists if each.name == name)
        reason = _tell_law(name, law, baseline)
    elif finding is Finding.UNKNOWN and not has_place and passed and test.explanations:
        ((name, residual),) = test.explanations.items()
        reason = _tell_stand_in(name, residual, thresholds)
    if finding is Finding.UNKNOWN:
        laws = [*test.laws.values()]
    else:
        held_back = ()
    if held_back:
        place, nearest, reason, laws = None, None, tell_held_back(held_back), []
    return Verdict(
        finding=finding, effects=effects, baseline=baseline, threshold=thresholds.gain,
        detectable=smallest_detectable(by.scores, thresholds.gain),
        units={score.effect.name: score.effect.parameters[0].unit for score in by.scores},
        place=place, nearest=nearest, model_error_size=model_error_size,
        reason=reason, pair=test.pair if effects else None, instead=test.instead,
        alike=_find_alike(by.scores, effects, finalists),
        laws=laws, held_back=held_back,
        probabilities=test.rank([each.refit for each in passed])[: len(effects)] if effects else [],
    )  # fmt: skip


def find_untestable(verdict: Verdict, is_seen: bool) -> Verdict:
    """The verdict, or that nothing could be tested.

    That nothing is missing says something only where an effect would have shown. And what is far off, where no motion
    stands out of its scatter, is noise.

    Parameters
    ----------
    verdict
        Verdict by the rules.
    is_seen
        Whether any motion stands out of its scatter.
    """
    why = ""
    detectable = np.array([*verdict.detectable.values()])
    if not is_seen and (verdict.finding in {Finding.NOTHING, Finding.NOT_CLOSE} or verdict.held_back):
        why = "no motion stands out of its scatter"
    elif verdict.finding is Finding.NOTHING and len(detectable) and not np.isfinite(detectable).any():
        why = "no effect would show in them at any strength that it may have"
    if not why:
        return verdict
    reason = f"These measurements cannot tell whether anything is missing: {why}."
    return replace(verdict, finding=Finding.NOT_TESTABLE, reason=reason, held_back=())


def _find_alike(scores: Sequence[Score], effects: Sequence[Refit], finalists: Sequence[Finalist]) -> list[str]:
    """Effects that change the data as the best does and were not fitted to the end, where all that were are named."""
    directions = {score.effect.name: score.direction for score in scores}
    best = directions.get(effects[0].name) if effects else None
    if best is None or len(effects) < max(2, len(finalists)):
        return []
    fitted = {each.name for each in finalists}
    return [
        name for name, each in directions.items() if name not in fitted and abs(float(each @ best)) > SAME_DIRECTION
    ]


def _tell_law(name: str, law: FittedLaw, baseline: Refit) -> str:
    falls = held_out_fall(baseline, law.refit)
    return (
        f"Something is missing, and it is none of the known effects: near {place_of(name)}, {law.words}, by which "
        f"{falls}. Nearest is {name}."
    )


def _tell_stand_in(name: str, residual: ResidualExplanation, thresholds: Thresholds) -> str:
    unknown = compute_excess_gain(residual.places[0]) - thresholds.misfit if residual.places else -np.inf
    if residual.gain - thresholds.gain > unknown:
        return (
            f"Something is missing, and no known effect alone explains it: {name} explains most, and "
            f"{residual.effect_name} much of what it leaves."
        )
    left = residual.places[0].sentence
    return f"Something is missing, and it is none of the known effects: {name} explains most, but leaves {left}."


def _tell_held_out_error(baseline: Refit) -> str:
    """A large error of the held-out data, beside that of the training data, in words."""
    held_out, others = (f"{plain(100 * error)} %" for error in (baseline.held_out_error, baseline.error))
    if baseline.reduced_chi2_by_noise > UNEXPLAINED:
        return (
            f"Something is missing, and no known effect explains it: the calibrated model errs by {held_out} on the "
            f"held-out data and by {others} on the others."
        )
    return (
        f"Something is missing that the held-out data alone show: the model errs by {held_out} there and by {others} "
        "on the others, in which nothing is missing. Hold out other data, so that a fit sees these."
    )
