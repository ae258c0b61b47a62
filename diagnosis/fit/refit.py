"""Nonlinear fits of shortlisted effects with the calibration parameters, and their test on held-out data.

The screening is linear, so that a refit may change its order; the held-out error ranks the refits.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from diagnosis.effect import EFFECTS
from diagnosis.fit.calibration import Fit, Matrix, calibrate
from diagnosis.fit.problem import Effort, Problem, Refit
from diagnosis.screening import Score
from diagnosis.step import RunStep, compute_step

#: An effect beside the best few is refitted if it is this parallel to one of them and has this share of its gain.
PARALLEL, PROMISING = 0.6, 0.5
#: Most effects that act through stick and slip alone and are refitted in any case: their derivative may have the wrong
#: sign, and had for the true effect among several lines and weights.
MOST_RUGGED = 8
#: A fit that gains less than this share of the gain of the screening is started again, from typical strength.
KEPT = 0.7
#: Reduced chi-squared beyond which a fit is lost; starts at these multiples of typical strength, to either side, are
#: then tried as well: far from the truth chi^2 has many minima, one for each shape of the peaks.
LOST, LADDER = 2.0, (0.03, 0.1, 0.3, 3.0, 10.0)


def shortlist(scores: Sequence[Score], effort: Effort, *, lost: bool = False) -> list[Score]:
    """Scores of effects that a refit may bring to the top.

    Parameters
    ----------
    scores
        Scores, best first.
    effort
        Number of effects, and the least gain.
    lost
        Whether the model fits badly, so that the order of the linear screening is less reliable.
    """
    n_best = effort.most if lost else effort.best
    best = list(scores[:n_best])
    chosen = [score for score in best if score.gain > effort.worthless]
    for score in scores[n_best:]:
        parallel = max((abs(float(score.direction @ other.direction)) for other in best), default=0.0)
        promising = score.gain > max(PROMISING * best[0].gain, effort.worthless)
        if len(chosen) < effort.most and promising and parallel > PARALLEL:
            chosen.append(score)
    kinds = {kind.name for kind in EFFECTS if kind.is_rugged}
    rugged = [score for score in scores if score.effect.kind in kinds and score not in chosen and score.size > 0]
    return chosen + rugged[:MOST_RUGGED]


def baseline_fit(problem: Problem) -> Refit:
    """Test of the calibration parameters alone."""
    return problem.tested(None, problem.fit)


def fit_effect(problem: Problem, score: Score) -> Fit:
    """Quick fit of one effect with the calibration parameters, accurate enough to choose the finalists.

    Parameters
    ----------
    problem
        Measurements and model.
    score
        Effect and start.
    """
    return multistart_fit(problem, score, quick_fit(problem, score))


def quick_fit(problem: Problem, score: Score) -> Fit:
    """Quick fit from the strength of the screening; from typical strength where that gains too little."""
    effect, baseline = score.effect, problem.fit
    unknowns, slopes = problem.unknowns([effect]), _slopes(score, baseline)
    quick = calibrate(problem.train, unknowns, score.start, baseline.prediction, slopes=slopes, quick=True)
    if baseline.chi2 - quick.chi2 < KEPT * score.gain:
        quick = min(quick, _fit_from(problem, score, 1.0), key=lambda fit: fit.chi2)
    return quick


def is_lost(problem: Problem, fit: Fit) -> bool:
    """Whether a fit is far from the minimum, by its reduced chi-squared."""
    return fit.chi2 >= LOST * problem.fit.n_number


def multistart_fit(problem: Problem, score: Score, quick: Fit) -> Fit:
    """Best quick fit from several strengths where the given one is lost; else the given one."""
    if problem.effort.patient and is_lost(problem, problem.fit):
        for share in (sign * step for step in LADDER for sign in (1.0, -1.0)):
            if not is_lost(problem, quick):
                break
            quick = min(quick, _fit_from(problem, score, share), key=lambda fit: fit.chi2)
    return quick


def multistart_fits(
    problem: Problem, fits: Sequence[tuple[Score, Fit]], run_step: RunStep = compute_step
) -> list[tuple[Score, Fit]]:
    """Quick fits of several effects, each by `multistart_fit`, best first, until one is not lost.

    Other starts of the remaining effects cannot change the verdict then: from two starts each they leave more than
    noise, and one effect does not.

    Parameters
    ----------
    problem
        Measurements and model.
    fits
        Effects with their `quick_fit`.
    run_step
        Looks up the stored result of a step, or computes it.
    """
    ranked = sorted(fits, key=lambda pair: pair[1].chi2)
    for number, (score, fit) in enumerate(ranked if problem.effort.patient else ()):
        if not all(is_lost(problem, other) for _, other in ranked):
            break
        wider = run_step(f"wider fit of {score.effect.name}", partial(multistart_fit, problem, score, fit))
        ranked[number] = (score, wider)
    return ranked


def _fit_from(problem: Problem, score: Score, share: float) -> Fit:
    """Quick fit from a multiple of typical strength, positive to the side of the strength of the screening."""
    effect, baseline = score.effect, problem.fit
    parameter = effect.parameters[0]
    size = share * abs(parameter.typical - parameter.vanishes)
    other = parameter.vanishes + np.sign(score.strength - parameter.vanishes or 1.0) * size
    rest = [each.vanishes for each in effect.parameters[1:]]
    start = np.array([*baseline.values, np.clip(other, parameter.lower, parameter.upper), *rest])
    return calibrate(problem.train, problem.unknowns([effect]), start, baseline.prediction, quick=True)


def choose_finalists(fits: Sequence[tuple[Score, Fit]], effort: Effort) -> list[tuple[Score, Fit]]:
    """Quick fits that deserve a thorough fit and a test, best first."""
    best = sorted(fits, key=lambda pair: pair[1].chi2)[: effort.finalists]
    return [pair for place, pair in enumerate(best) if place < 2 or pair[1].chi2 < best[0][1].chi2 + effort.far_behind]


def refit(problem: Problem, score: Score, quick: Fit | None = None) -> Refit:
    """Fit one effect thoroughly, and test it on the held-out data.

    Parameters
    ----------
    problem
        Measurements and model.
    score
        Effect.
    quick
        Quick fit of it; computed by default.
    """
    quick = fit_effect(problem, score) if quick is None else quick
    fit = calibrate(problem.train, quick.unknowns, quick.values, quick.prediction, slopes=quick.jacobian)
    return problem.tested(score.effect, fit)


def _slopes(score: Score, baseline: Fit) -> Matrix | None:
    """Jacobian at the start from the screening; none for an effect of several parameters or without a slope."""
    if len(score.effect.parameters) > 1 or not score.slope.any():
        return None
    # The effect has no prior: its row below those of the calibration parameters is zero.
    return np.pad(np.column_stack([baseline.jacobian, score.slope]), ((0, 1), (0, 0)))
