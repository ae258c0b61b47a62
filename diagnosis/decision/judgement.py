"""Judgement of finalists: their order, and the verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from diagnosis.candidate.catalogue import Catalogue
from diagnosis.decision.closeness import AbsentPeak, FarResonance, list_held_back
from diagnosis.decision.evidence import compute_log_density, passes
from diagnosis.decision.rules import decide, find_untestable
from diagnosis.decision.verdict import Verdict
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.problem import Refit
from diagnosis.screening import Score
from diagnosis.step import RunStep
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.unknown_force import UnknownForce


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
        model_error_size, held_back = baseline.arrangement.model_error_size, list_held_back(baseline.refit.fit)
        return decide(
            by.catalogue,
            by.scores,
            baseline.refit,
            ranked,
            places,
            by.thresholds,
            run_step,
            model_error_size,
            by.far,
            held_back,
        )

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
