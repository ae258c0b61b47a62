"""Nonlinear fits of shortlisted effects with the calibration parameters, and their test on held-out data.

The screening is linear, so that refits may change its order.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from correlation.prediction import Prediction
from diagnosis.candidate.effect import Effect
from diagnosis.effect import find_kind
from diagnosis.fit.calibration import MIN_GAIN, Ending, Fit, Matrix, calibrate, recalibrate
from diagnosis.fit.fit_parameter import Values, make_start
from diagnosis.fit.problem import EffectSelection, FitProblem, Refit
from diagnosis.screening import Score
from diagnosis.step import RunStep, compute_step

#: Least |cos| to one of the best few effects, and least share of the best gain, for another effect to be refitted [-].
MIN_COSINE, MIN_GAIN_SHARE = 0.6, 0.5
#: Largest number of effects acting through stick and slip alone that are refitted in any case. Their derivative may
#: have the wrong sign; this was observed for the true effect with several lines and weights.
MAX_BY_SLIP = 8
#: A fit with less than this share of the gain of the screening is started again, from typical strength [-].
MIN_GAIN_KEPT = 0.7
#: Ratio of chi^2 to that without an effect above which a fit from another start is abandoned after a few steps. Set on
#: development seeds [-].
MAX_CHI2_RATIO = 2.0
#: Reduced chi-squared above which a fit is poor: the model lacks a strong effect. Set on development seeds [-].
MAX_RESPONSE_FIT_CHI2 = 2.0


def shortlist(scores: Sequence[Score], selection: EffectSelection, *, is_poor: bool = False) -> list[Score]:
    """Scores of effects that may become the best one in a refit.

    Parameters
    ----------
    scores
        Scores, best first.
    selection
        Number of effects, and the least gain.
    is_poor
        Whether the model fits badly, so that the order of the linear screening is less reliable.
    """
    n_best = selection.n_shortlisted if is_poor else selection.n_best
    best = list(scores[:n_best])
    chosen = [score for score in best if score.gain > selection.least_gain]
    for score in scores[n_best:]:
        parallel = max((abs(float(score.direction @ other.direction)) for other in best), default=0.0)
        promising = score.gain > max(MIN_GAIN_SHARE * best[0].gain, selection.least_gain)
        if len(chosen) < selection.n_shortlisted and promising and parallel > MIN_COSINE:
            chosen.append(score)
    by_slip = [score for score in scores if acts_by_slip_alone(score.effect) and score not in chosen and score.size > 0]
    return chosen + by_slip[:MAX_BY_SLIP]


def acts_by_slip_alone(effect: Effect) -> bool:
    """Whether an effect acts through stick and slip alone, see `diagnosis.effect.EffectKind`."""
    kind = find_kind(effect)
    return kind is not None and kind.acts_by_slip_alone


def make_baseline_refit(problem: FitProblem) -> Refit:
    """Test of the calibration parameters alone."""
    return problem.tested(None, problem.fit)


def fit_quickly(problem: FitProblem, score: Score) -> Fit:
    """Quick fit from the strength of the screening, and from typical strength if the gain is too small.

    The slopes of the screening are those without the effect. If they mislead the fit, a fit with the slopes at its
    start is tried first. If chi^2 may have a minimum on either side of the neutral strength, the derivative may point
    to the wrong one; such effects are fitted from the other side as well. A fit that ends above the one without the
    effect starts again from there.
    """
    effect, baseline = score.effect, problem.fit
    begin = partial(fit_from, problem, effect, ceiling=MAX_CHI2_RATIO * baseline.chi2)
    unknowns, slopes = problem.unknowns([effect]), _make_first_jacobian(score, baseline)
    fits = [calibrate(problem.train, unknowns, score.start, baseline.prediction, slopes=slopes, ending=Ending.QUICK)]
    for start in ([] if slopes is None else [score.start]) + [_make_typical_start(problem, score)]:
        if baseline.chi2 - min(fit.chi2 for fit in fits) < MIN_GAIN_KEPT * score.gain:
            fits.append(begin(start))
    kind = find_kind(effect)
    if kind is not None and kind.has_two_sides:
        fits.append(begin(_make_typical_start(problem, score, side=-1.0)))
    if min(fit.chi2 for fit in fits) > baseline.chi2 + MIN_GAIN:
        fits.append(begin(make_start(baseline.values, effect, effect.parameters[0].vanishes)))
    return min(fits, key=lambda fit: fit.chi2)


def is_poor_fit(problem: FitProblem) -> bool:
    """Whether the first fit is poor, by its reduced chi-squared."""
    return problem.fit.chi2 >= MAX_RESPONSE_FIT_CHI2 * problem.fit.n_number


def fit_from_starts(
    problem: FitProblem,
    scores: Sequence[Score],
    fits: Sequence[tuple[Score, Fit]],
    starts: Sequence[tuple[Effect, Values]],
    run_step: RunStep = compute_step,
    *,
    like: str = "",
    nearby: Prediction | None = None,
) -> list[tuple[Score, Fit]]:
    """Quick fits of effects; for each the best of the given fit and those from other starts.

    Parameters
    ----------
    problem
        Measurements and model.
    scores
        Scores of all effects.
    fits
        Effects with their `fit_quickly`.
    starts
        Effects with start values of their other fits; an effect may have several.
    run_step
        Looks up the stored result of a step, or computes it.
    like, nearby
        Name and prediction of the fit from which the starts are taken, if any.
    """
    result, by_name = (
        {score.effect.name: (score, fit) for score, fit in fits},
        {item.effect.name: item for item in scores},
    )
    ceiling = MAX_CHI2_RATIO * problem.fit.chi2
    for number, (effect, start) in enumerate(starts):
        name, begin = effect.name, partial(fit_from, problem, effect, start, nearby, ceiling=ceiling)
        fit = run_step(f"fit of {name} from {f'that of {like}' if like else f'start {number}'}", begin)
        if name not in result or fit.chi2 < result[name][1].chi2:
            result[name] = (by_name[name], fit)
    return list(result.values())


def fit_from(
    problem: FitProblem,
    effect: Effect,
    start: Values,
    nearby: Prediction | None = None,
    *,
    ceiling: float = np.inf,
) -> Fit:
    """Quick fit of an effect from given values.

    Parameters
    ----------
    problem, effect
        Measurements and model, and the effect.
    start
        Values of the calibration parameters, the added effects and the effect, shape (p,).
    nearby
        Prediction from which the states start; that of the first fit by default.
    ceiling
        As for `calibrate`.
    """
    nearby = problem.fit.prediction if nearby is None else nearby
    return calibrate(problem.train, problem.unknowns([effect]), start, nearby, ending=Ending.QUICK, ceiling=ceiling)


def _make_typical_start(problem: FitProblem, score: Score, side: float = 1.0) -> Values:
    """Values of the first fit with typical strength, on the side found by the screening (1) or on the other (-1)."""
    parameter = score.effect.parameters[0]
    size = abs(parameter.typical - parameter.vanishes)
    other = parameter.vanishes + side * np.sign(score.strength - parameter.vanishes or 1.0) * size
    strength = float(np.clip(other, parameter.lower, parameter.upper))
    return make_start(problem.fit.values, score.effect, strength)


def choose_finalists(
    fits: Sequence[tuple[Score, Fit]], costs: Sequence[float], selection: EffectSelection
) -> list[tuple[Score, Fit]]:
    """Quick fits selected for a thorough fit and a test, lowest cost first.

    The one with the lowest chi^2 is always included, since the cost of a quick fit counts an incomplete convergence as
    model error.
    """
    ranked = np.argsort(costs, kind="stable").tolist()
    best = [
        number
        for place, number in enumerate(ranked[: selection.n_finalist])
        if place < 2 or costs[number] < costs[ranked[0]] + selection.largest_chi2_gap
    ]
    closest = min(ranked, key=lambda number: fits[number][1].chi2, default=None)
    if closest is not None and closest not in best:
        best.append(closest)
    return [fits[number] for number in best]


def refit(problem: FitProblem, score: Score, quick: Fit | None = None) -> Refit:
    """Fit one effect thoroughly, and test it on the held-out data.

    Parameters
    ----------
    problem
        Measurements and model.
    score
        Effect.
    quick
        Quick fit of the effect; computed by default.
    """
    quick = fit_quickly(problem, score) if quick is None else quick
    fit = recalibrate(problem.train, quick, slopes=quick.jacobian)
    return problem.tested(score.effect, fit)


def _make_first_jacobian(score: Score, baseline: Fit) -> Matrix | None:
    """Jacobian at the start from the screening; None for an effect with several parameters or without a slope."""
    if len(score.effect.parameters) > 1 or not score.slope.any():
        return None
    # The effect has no prior: its row below those of the calibration parameters is zero.
    return np.pad(np.column_stack([baseline.jacobian, score.slope]), ((0, 1), (0, 0)))
