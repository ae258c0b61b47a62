"""Effects at places that the case does not name: tried if no single effect at named places explains the measurements.

A case names the places where an engineer expects effects. A true effect elsewhere may be imitated by two effects at
named places.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.unnamed_place import list_unnamed_places
from diagnosis.candidate.catalogue import Extra, list_campaign_effects
from diagnosis.candidate.effect import Effect
from diagnosis.decision.evidence import DECISIVE, compute_log_density, passes
from diagnosis.decision.law_of_force import compute_law_density
from diagnosis.decision.rules import Criteria
from diagnosis.decision.verdict import Verdict
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.finalist import Finalist, refit_each_by_own_covariance
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import fit_quickly, refit
from diagnosis.localisation import localise
from diagnosis.model_error_share import compute_gains_by_covariance, list_covariances
from diagnosis.screening import Score, screen
from diagnosis.step import RunStep

#: Largest number of unnamed displacements at which an unknown force is tried, evenly chosen, and of those with the
#: largest gain at which effects are tried. Both limit time and memory for large structures.
MAX_FORCES, MAX_PLACES = 24, 4


def list_effects_elsewhere(
    campaign: Campaign, arrangement: Arrangement, without: Collection[str] = (), extra: Sequence[Extra] = ()
) -> list[Effect]:
    """Effects of all kinds at the few unnamed displacements at which an unknown force explains most.

    Empty if there are finer models, whose nodes are at other points.

    Parameters
    ----------
    campaign, arrangement
        Measurements and model.
    without, extra
        As for `diagnosis.candidate.catalogue.list_effects`.
    """
    unnamed = {} if arrangement.finer else dict(list_unnamed_places(arrangement.base))
    chosen = [*unnamed][:: max(-(-len(unnamed) // MAX_FORCES), 1)]
    if not chosen:
        return []
    fit = arrangement.fit
    forced = replace(fit, model=replace(fit.model, places={name: unnamed[name] for name in chosen}))
    ranked = localise(replace(arrangement, fit=forced), list_covariances(arrangement))
    places = [*dict.fromkeys(place.name for place in ranked)][:MAX_PLACES]
    # With the places of the case, so that no effect at these is listed under another name.
    model = replace(arrangement.base, places={**arrangement.base.places, **{name: unnamed[name] for name in places}})
    listed = list_campaign_effects(campaign, model, without=without, extra=extra).candidates
    added = {item.name for item in arrangement.added}
    return [item for item in listed if item.name not in added and item.name.endswith(tuple(f" at {p}" for p in places))]


def find_better_elsewhere(
    screening: Arrangement,
    effects: Sequence[Effect],
    baseline: Finalist,
    finalists: Sequence[Finalist],
    verdict: Verdict,
    by: Criteria,
    run_step: RunStep,
) -> tuple[list[Score], list[Finalist]]:
    """Effects that pass and are more probable than all explanations at named places, and their scores.

    They must be more probable by odds of 20 to 1, times the number of effects tried.

    Parameters
    ----------
    screening
        Arrangement with which effects are screened and fitted.
    effects
        Effects at unnamed places.
    baseline, finalists
        Fit without an effect, and effects at named places, each with its own covariance.
    verdict
        Verdict with the effects at named places.
    by
        Thresholds, and function that fits an effect with its own covariance.
    run_step
        Looks up the stored result of a step, or computes it.
    """
    if not effects or by.refit_by_own_covariance is None:
        return [], []
    name = f"effects elsewhere beyond {by.thresholds.gain:.6g}"
    fitted = run_step(name, lambda: _refit_best(screening, effects, by.thresholds.gain))
    own = partial(by.refit_by_own_covariance, screening.train)
    result = refit_each_by_own_covariance(screening, [item for _, item in fitted], own, run_step)
    least = _compute_known_density(baseline, finalists, verdict, by) + DECISIVE + 2 * np.log(len(effects))
    passed = [item for item in result if passes(item.refit, by.thresholds)]
    better = [item for item in passed if compute_log_density(item.refit) > least]
    names = {item.name for item in better}
    return [score for score, item in fitted if item.name in names], better


def _refit_best(problem: Arrangement, effects: Sequence[Effect], threshold: float) -> list[tuple[Score, Refit]]:
    """Thorough fits of the few effects with the largest first-order gain above a threshold; best first."""
    gains = compute_gains_by_covariance(problem, effects).max(axis=0, initial=0.0)
    promising = [number for number in np.argsort(-gains).tolist() if gains[number] > threshold]
    scores = screen(problem, [effects[number] for number in promising[: problem.selection.n_finalist]])
    fitted = [(score, refit(problem, score, fit_quickly(problem, score))) for score in scores]
    return sorted(fitted, key=lambda pair: problem.cost_with_error_left(pair[1].fit))


def _compute_known_density(baseline: Finalist, finalists: Sequence[Finalist], verdict: Verdict, by: Criteria) -> float:
    """Largest 2 ln of the density of all data: without an effect, with passing effects, two effects, or a law."""
    densities = [-(baseline.arrangement.cost + baseline.refit.held_out_cost)]
    densities += [compute_log_density(item.refit) for item in finalists if passes(item.refit, by.thresholds)]
    if verdict.pair is not None:
        densities.append(compute_log_density(verdict.pair.first.refit))
    if verdict.nearest is not None:
        densities += [compute_law_density(verdict.nearest, law) for law in verdict.laws]
    return max(densities)
