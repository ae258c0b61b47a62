"""Fits started from the fit of another effect that changes the data in the same way, but fits them better.

At the onset of slip a derivative predicts little of a strong effect. Of two equivalent effects, such as preload and gap
of a closed contact, the fit of one may therefore reach a minimum that the other one misses.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from diagnosis.candidate.effect import Effect
from diagnosis.candidate.far_strength import list_far_strengths
from diagnosis.fit.calibration import Fit, compute_chi2
from diagnosis.fit.fit_parameter import Values, make_start
from diagnosis.fit.problem import FitProblem
from diagnosis.fit.refit import fit_from_starts
from diagnosis.screening import Score
from diagnosis.step import RunStep, compute_step

#: Largest share of the best gain that an effect like the best one loses by its direction: a cosine of 0.92.
MAX_SHARE_BEHIND = 0.15
#: Largest number of rounds; each starts the other fits again from the effect that has become the best one.
ROUNDS = 3


def fit_alike(
    problem: FitProblem, scores: Sequence[Score], fits: Sequence[tuple[Score, Fit]], run_step: RunStep = compute_step
) -> list[tuple[Score, Fit]]:
    """The fits, improved for effects that should fit as well as the best one but do not.

    Parameters
    ----------
    problem
        Measurements and model.
    scores
        Scores of all effects.
    fits
        Effects with their quick fits.
    run_step
        Looks up the stored result of a step, or computes it.
    """
    result, name = list(fits), ""
    for number in range(ROUNDS):
        best = min(result, key=lambda pair: pair[1].chi2, default=None)
        if best is None or best[0].effect.name == name:
            break
        name = best[0].effect.name
        like = f"{name}, round {number + 1}"
        starts = run_step(f"starts like {like}", partial(list_starts_alike, problem, scores, result, *best))
        result = fit_from_starts(problem, scores, result, starts, run_step, like=like, nearby=best[1].prediction)
    return result


def list_starts_alike(
    problem: FitProblem, scores: Sequence[Score], fits: Sequence[tuple[Score, Fit]], best: Score, best_fit: Fit
) -> list[tuple[Effect, Values]]:
    """Effects that should fit as well as the best one but do not, with start values for their fits.

    To first order the gain of an effect is below that of another by at most the share 1 - cos^2, with the angle between
    their changes. If it gains far less, its fit ended in another minimum, or was not made, because its slope misled the
    screening.

    Parameters
    ----------
    problem, scores, fits
        As for `fit_alike`.
    best, best_fit
        The best of the effects, and its fit.
    """
    chi2_by_name = {score.effect.name: item.chi2 for score, item in fits}
    selection, gain = problem.selection, problem.fit.chi2 - best_fit.chi2
    missed = list[tuple[float, Score]]()
    for score in scores if gain > 0 else ():
        behind = (1 - float(score.direction @ best.direction) ** 2) * gain
        is_worse = chi2_by_name.get(score.effect.name, np.inf) > best_fit.chi2 + behind + selection.least_gain
        is_alike = behind < min(MAX_SHARE_BEHIND * gain, selection.largest_chi2_gap)
        if score.size and best.size and is_worse and is_alike:
            missed.append((behind, score))
    nearest = sorted(missed, key=lambda pair: pair[0])[: selection.n_finalist]
    return [(score.effect, _start_like(problem, score, best, best_fit)) for _, score in nearest]


def _start_like(problem: FitProblem, score: Score, best: Score, fit: Fit) -> Values:
    """Values of a fit with its effect replaced by another one, at the equivalent strength or at a far one."""
    own, other, n_fitted = score.effect.parameters[0], best.effect.parameters[0], len(problem.fit.values)
    share = (fit.values[n_fitted] - other.vanishes) / (other.typical - other.vanishes) * best.size / score.size
    equal = own.vanishes + share * np.sign(score.direction @ best.direction) * (own.typical - own.vanishes)
    strengths = [float(np.clip(equal, own.lower, own.upper)), *list_far_strengths(own).ravel()]
    unknowns = problem.unknowns([score.effect])
    starts = [make_start(fit.values[:n_fitted], score.effect, strength) for strength in strengths]
    return min(starts, key=lambda start: compute_chi2(problem.train, unknowns, start, fit.prediction))
