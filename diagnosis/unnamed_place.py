"""Effects where no place of the case is: tried if no single effect at its places explains the measurements.

A case names the places where an engineer expects something. Of what lies beside them, two effects at two places
may do the same as one that is really there.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.unnamed_place import list_unnamed_places
from diagnosis.candidate.catalogue import Catalogue, list_campaign_effects
from diagnosis.candidate.effect import Effect
from diagnosis.decision.evidence import DECISIVE, compute_log_density, passes
from diagnosis.decision.rules import Criteria
from diagnosis.decision.verdict import Verdict
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.finalist import Finalist, refit_each_by_own_covariance
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import quick_fit, refit
from diagnosis.model_error_share import compute_gains_by_covariance
from diagnosis.screening import Score, screen
from diagnosis.step import RunStep


def list_effects_elsewhere(
    campaign: Campaign, arrangement: Arrangement, catalogue: Catalogue, without: Collection[str] = ()
) -> list[Effect]:
    """Effects of all kinds at displacements that no place follows; none beside finer models, which lack these.

    Parameters
    ----------
    campaign, arrangement
        Measurements and model.
    catalogue
        Effects at the places of the model.
    without
        Kinds to leave out.
    """
    places = {} if arrangement.finer else list_unnamed_places(arrangement.base)
    if not places:
        return []
    elsewhere = replace(arrangement.base, places=places)
    listed = list_campaign_effects(campaign, elsewhere, without=without).candidates
    return [each for each in listed if each.name not in catalogue.names and each.name.partition(" at ")[2] in places]


def find_better_elsewhere(
    screening: Arrangement, effects: Sequence[Effect], verdict: Verdict, by: Criteria, run_step: RunStep
) -> tuple[list[Score], list[Finalist]]:
    """Effects that pass and are more probable than what a verdict says, to odds of one in twenty, and their scores.

    Parameters
    ----------
    screening
        Arrangement by which effects are screened and fitted.
    effects
        Effects where no place is.
    verdict
        Two effects are missing, or something unknown.
    by
        Thresholds, and how an effect is fitted by its own covariance.
    run_step
        Looks up the stored result of a step, or computes it.
    """
    assert by.refit_by_own_covariance is not None
    fitted = run_step(
        f"effects elsewhere beyond {by.thresholds.gain:.6g}",
        lambda: _refit_best(screening, effects, by.thresholds.gain) if effects else [],
    )
    known = _get_best_known(verdict)
    # Another covariance does not turn what is so far behind.
    worst = screening.cost_with_error_left(known.fit) + screening.selection.largest_chi2_gap
    near = [each for _, each in fitted if screening.cost_with_error_left(each.fit) < worst]
    own = partial(by.refit_by_own_covariance, screening.train)
    finalists = refit_each_by_own_covariance(screening, near, own, run_step)
    least = compute_log_density(known) + DECISIVE
    better = [
        each for each in finalists if passes(each.refit, by.thresholds) and compute_log_density(each.refit) > least
    ]
    names = {each.name for each in better}
    return [score for score, each in fitted if each.name in names], better


def _refit_best(problem: Arrangement, effects: Sequence[Effect], threshold: float) -> list[tuple[Score, Refit]]:
    """Thorough fits of the few effects that gain most to first order, and more than a threshold; the best first."""
    gains = compute_gains_by_covariance(problem, effects).max(axis=0, initial=0.0)
    promising = [number for number in np.argsort(-gains).tolist() if gains[number] > threshold]
    scores = screen(problem, [effects[number] for number in promising[: problem.selection.n_finalist]])
    fitted = [(score, refit(problem, score, quick_fit(problem, score))) for score in scores]
    return sorted(fitted, key=lambda pair: problem.cost_with_error_left(pair[1].fit))


def _get_best_known(verdict: Verdict) -> Refit:
    """The fit that explains most of what a verdict says: with both effects, or the nearest law or effect."""
    if verdict.pair is not None:
        return verdict.pair.first.refit
    laws = [law.refit for law in verdict.laws]
    return [*laws, *([] if verdict.nearest is None else [verdict.nearest]), verdict.baseline][0]
