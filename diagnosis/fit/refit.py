"""Shortlisted effects fitted in earnest with the calibration parameters, from several starts, tested on held-out data.

The screening is linear; a refit has turned its order round more than once. What ranks is the held-out error.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from diagnosis.effect import EFFECTS
from diagnosis.fit.calibration import Fit, Matrix, calibrate
from diagnosis.fit.problem import Effort, Problem, Refit
from diagnosis.keep import Keep, computed
from diagnosis.screening import Score

#: Beside the best few, others are refitted that are this parallel to one of them and promise this share of its gain.
PARALLEL, PROMISING = 0.6, 0.5
#: What acts through stick and slip alone is refitted in any case, up to so many: its derivative may point the wrong
#: way, and of several lines and weights that of the true one did.
MOST_RUGGED = 8
#: A fit that gains less than this share of what the screening promised is begun once more, from typical strength.
KEPT = 0.7
#: chi^2 a number beyond which the best fit has not found the way; then starts at these multiples of typical strength,
#: to either side, are tried as well: far from the truth chi^2 has many minima, one for each shape of the peaks.
LOST, LADDER = 2.0, (0.03, 0.1, 0.3, 3.0, 10.0)


def shortlist(scores: Sequence[Score], effort: Effort, *, lost: bool = False) -> list[Score]:
    """Those that a refit may bring to the top.

    Parameters
    ----------
    scores
        Best first.
    effort
        How many, and from what gain on.
    lost
        Whether the model fits badly: the screening is linear, and its order then says less.
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
    """The calibration parameters alone."""
    return problem.tested(None, problem.fit)


def fit_effect(problem: Problem, score: Score) -> Fit:
    """Fit one effect beside the calibration parameters, quickly: good enough to tell who comes into question.

    Parameters
    ----------
    problem
        Measurements and model.
    score
        The effect, and where to start.
    """
    return multistart_fit(problem, score, quick_fit(problem, score))


def quick_fit(problem: Problem, score: Score) -> Fit:
    """The quick fit from where the screening saw the effect, and where that keeps little, from typical strength."""
    effect, baseline = score.effect, problem.fit
    unknowns, slopes = problem.unknowns([effect]), _slopes(score, baseline)
    found = calibrate(problem.train, unknowns, score.start, baseline.prediction, slopes=slopes, quick=True)
    if baseline.chi2 - found.chi2 < KEPT * score.gain:
        found = min(found, _fitted_from(problem, score, 1.0), key=lambda fit: fit.chi2)
    return found


def is_lost(problem: Problem, fit: Fit) -> bool:
    """Whether a fit has not found the way."""
    return fit.chi2 >= LOST * problem.fit.n_number


def multistart_fit(problem: Problem, score: Score, found: Fit) -> Fit:
    """A better quick fit than one that is lost, from starts far and near; the same one where there is none."""
    if is_lost(problem, problem.fit):
        for share in (sign * step for step in LADDER for sign in (1.0, -1.0)):
            if not is_lost(problem, found):
                break
            found = min(found, _fitted_from(problem, score, share), key=lambda fit: fit.chi2)
    return found


def multistart_fits(
    problem: Problem, fits: Sequence[tuple[Score, Fit]], keep: Keep = computed
) -> list[tuple[Score, Fit]]:
    """Quick fits of several effects, `multistart_fit` one after another, best first, until one has found the way.

    What the others would gain from other starts is then nothing to the verdict: they leave more unexplained than noise
    does, from where the screening saw them and from typical strength, and one of them does not.

    Parameters
    ----------
    problem
        Measurements and model.
    fits
        Each as `quick_fit` left it.
    keep
        Looks up what a step gave before, or makes it.
    """
    found = sorted(fits, key=lambda pair: pair[1].chi2)
    for number, (score, fit) in enumerate(found):
        if not all(is_lost(problem, each) for _, each in found):
            break
        wider = keep(f"wider fit of {score.effect.name}", partial(multistart_fit, problem, score, fit))
        found[number] = (score, wider)
    return found


def _fitted_from(problem: Problem, score: Score, share: float) -> Fit:
    """From a multiple of typical strength, positive to the side where the screening saw the effect."""
    effect, baseline = score.effect, problem.fit
    parameter = effect.parameters[0]
    size = share * abs(parameter.typical - parameter.vanishes)
    other = parameter.vanishes + np.sign(score.strength - parameter.vanishes or 1.0) * size
    rest = [each.vanishes for each in effect.parameters[1:]]
    start = np.array([*baseline.values, np.clip(other, parameter.lower, parameter.upper), *rest])
    return calibrate(problem.train, problem.unknowns([effect]), start, baseline.prediction, quick=True)


def choose_finalists(fits: Sequence[tuple[Score, Fit]], effort: Effort) -> list[tuple[Score, Fit]]:
    """Those of quick fits that are worth a thorough one and a test, best first."""
    best = sorted(fits, key=lambda pair: pair[1].chi2)[: effort.finalists]
    return [pair for place, pair in enumerate(best) if place < 2 or pair[1].chi2 < best[0][1].chi2 + effort.far_behind]


def refit(problem: Problem, score: Score, quick: Fit | None = None) -> Refit:
    """Fit one effect thoroughly, and test it on the held-out data.

    Parameters
    ----------
    problem
        Measurements and model.
    score
        The effect.
    quick
        Its quick fit; made by default.
    """
    quick = fit_effect(problem, score) if quick is None else quick
    fit = calibrate(problem.train, quick.unknowns, quick.values, quick.prediction, slopes=quick.jacobian)
    return problem.tested(score.effect, fit)


def refit_anew(problem: Problem, found: Refit) -> Refit:
    """An effect fitted again from where it was, to measurements that are weighed otherwise."""
    fit = calibrate(problem.train, found.fit.unknowns, found.fit.values, found.fit.prediction)
    return problem.tested(found.effect, fit)


def _slopes(score: Score, baseline: Fit) -> Matrix | None:
    """Jacobian at the start as the screening knows it; none for what it does not."""
    if len(score.effect.parameters) > 1 or not score.slope.any():
        return None
    # The effect has no prior: its row below those of the calibration parameters is zero.
    return np.pad(np.column_stack([baseline.jacobian, score.slope]), ((0, 1), (0, 0)))
