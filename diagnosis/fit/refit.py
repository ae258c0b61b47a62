"""Shortlisted effects fitted in earnest with the accepted parameters, from several starts, tested on held-out data.

The screening is linear; a refit has turned its order round more than once. What ranks is the held-out error.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.prediction import Prediction
from diagnosis.effect.candidate import Effect
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration import Fit, calibrate
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.one_effect import OneEffect
from diagnosis.fit.unknowns import Unknowns
from diagnosis.keep import Keep, computed
from diagnosis.screening import Score

#: The best few are refitted, and all others this parallel to one of them that promise this share of the best gain.
BEST, PARALLEL, PROMISING, MOST = 3, 0.6, 0.5, 6
#: Of the shortlist, two are fitted thoroughly and tested, and up to so many whose chi^2 is not so far behind.
FINALISTS, FAR_BEHIND = 3, 40.0
#: What acts through stick and slip alone is refitted in any case: its derivative may point the wrong way, and of
#: several lines and weights that of the true one did.
RUGGED, MOST_RUGGED = ("pre-load", "friction coefficient"), 8
#: Gains below this are not worth a refit: the best of some dozens of candidates has more by chance.
WORTHLESS = 3.0
#: A fit that gains less than this share of what the screening promised is begun once more, from typical strength.
KEPT = 0.7
#: chi^2 a number beyond which the best fit has not found the way; then starts at these multiples of typical strength,
#: to either side, are tried as well: far from the truth chi^2 has many minima, one for each shape of the peaks.
LOST, LADDER = 2.0, (0.03, 0.1, 0.3, 3.0, 10.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Refit(OneEffect):
    """One effect, or none, fitted with the accepted parameters.

    Parameters
    ----------
    effect
        None for the accepted parameters alone.
    fit
        On the training data.
    held_chi2
        chi^2 a number of the held-out data [-].
    error, held_error
        |measured - predicted| / |measured| of the fundamentals of motion, training and held-out [-].
    """

    fit: Fit
    held_chi2: float
    error: float
    held_error: float


def shortlist(scores: Sequence[Score], *, lost: bool = False) -> list[Score]:
    """Those that a refit may bring to the top.

    Parameters
    ----------
    scores
        Best first.
    lost
        Whether the model fits badly: the screening is linear, and its order then says less.
    """
    n_best = MOST if lost else BEST
    best = list(scores[:n_best])
    chosen = [score for score in best if score.gain > WORTHLESS]
    for score in scores[n_best:]:
        parallel = max((abs(float(score.direction @ other.direction)) for other in best), default=0.0)
        if len(chosen) < MOST and score.gain > max(PROMISING * best[0].gain, WORTHLESS) and parallel > PARALLEL:
            chosen.append(score)
    rugged = [score for score in scores if score.effect.kind in RUGGED and score not in chosen and score.size > 0]
    return chosen + rugged[:MOST_RUGGED]


def unchanged(arrangement: Arrangement) -> Refit:
    """The accepted parameters alone."""
    return _tested(arrangement, None, arrangement.fit)


def fitted(arrangement: Arrangement, score: Score) -> Fit:
    """Fit one effect beside the accepted parameters, quickly: good enough to tell who comes into question.

    Parameters
    ----------
    arrangement
        Measurements and model.
    score
        The effect, and where to start.
    """
    return searched(arrangement, score, begun(arrangement, score))


def begun(arrangement: Arrangement, score: Score) -> Fit:
    """The quick fit from where the screening saw the effect, and where that keeps little, from typical strength."""
    effect, accepted = score.effect, arrangement.fit
    unknowns, slopes = arrangement.unknowns([effect]), _slopes(score, accepted)
    found = calibrate(arrangement.train, unknowns, score.start, accepted.prediction, slopes=slopes, quick=True)
    if accepted.chi2 - found.chi2 < KEPT * score.gain:
        found = min(found, _fitted_from(arrangement, score, 1.0), key=lambda fit: fit.chi2)
    return found


def is_lost(arrangement: Arrangement, fit: Fit) -> bool:
    """Whether a fit has not found the way."""
    return fit.chi2 >= LOST * arrangement.fit.n_number


def searched(arrangement: Arrangement, score: Score, found: Fit) -> Fit:
    """A better quick fit than one that is lost, from starts far and near; the same one where there is none."""
    if is_lost(arrangement, arrangement.fit):
        for share in (sign * step for step in LADDER for sign in (1.0, -1.0)):
            if not is_lost(arrangement, found):
                break
            found = min(found, _fitted_from(arrangement, score, share), key=lambda fit: fit.chi2)
    return found


def all_searched(
    arrangement: Arrangement, fits: Sequence[tuple[Score, Fit]], keep: Keep = computed
) -> list[tuple[Score, Fit]]:
    """Quick fits of several effects, `searched` one after another, best first, until one has found the way.

    What the others would gain from other starts is then nothing to the verdict: they leave more unexplained than noise
    does, from where the screening saw them and from typical strength, and one of them does not.

    Parameters
    ----------
    arrangement
        Measurements and model.
    fits
        Each as `begun` left it.
    keep
        Looks up what a step gave before, or makes it.
    """
    found = sorted(fits, key=lambda pair: pair[1].chi2)
    for number, (score, fit) in enumerate(found):
        if not all(is_lost(arrangement, each) for _, each in found):
            break
        wider = keep(f"wider fit of {score.effect.name}", partial(searched, arrangement, score, fit))
        found[number] = (score, wider)
    return found


def _fitted_from(arrangement: Arrangement, score: Score, share: float) -> Fit:
    """From a multiple of typical strength, positive to the side where the screening saw the effect."""
    effect, accepted = score.effect, arrangement.fit
    parameter = effect.parameters[0]
    size = share * abs(parameter.typical - parameter.vanishes)
    other = parameter.vanishes + np.sign(score.strength - parameter.vanishes or 1.0) * size
    rest = [each.vanishes for each in effect.parameters[1:]]
    start = np.array([*accepted.values, np.clip(other, parameter.lower, parameter.upper), *rest])
    return calibrate(arrangement.train, arrangement.unknowns([effect]), start, accepted.prediction, quick=True)


def finalists(fits: Sequence[tuple[Score, Fit]]) -> list[tuple[Score, Fit]]:
    """Those of quick fits that are worth a thorough one and a test, best first."""
    best = sorted(fits, key=lambda pair: pair[1].chi2)[:FINALISTS]
    return [pair for place, pair in enumerate(best) if place < 2 or pair[1].chi2 < best[0][1].chi2 + FAR_BEHIND]


def refit(arrangement: Arrangement, score: Score, quick: Fit | None = None) -> Refit:
    """Fit one effect thoroughly, and test it on the held-out data.

    Parameters
    ----------
    arrangement
        Measurements and model.
    score
        The effect.
    quick
        Its quick fit; made by default.
    """
    quick = fitted(arrangement, score) if quick is None else quick
    fit = calibrate(arrangement.train, quick.unknowns, quick.values, quick.prediction, slopes=quick.jacobian)
    return _tested(arrangement, score.effect, fit)


def refit_anew(arrangement: Arrangement, found: Refit) -> Refit:
    """An effect fitted again from where it was, to measurements that are weighed otherwise."""
    fit = calibrate(arrangement.train, found.fit.unknowns, found.fit.values, found.fit.prediction)
    return _tested(arrangement, found.effect, fit)


def _slopes(score: Score, accepted: Fit) -> Float[NDArray[np.float64], "m p"] | None:
    """Jacobian at the start as the screening knows it; none for what it does not."""
    if len(score.effect.parameters) > 1 or not score.slope.any():
        return None
    # The effect has no prior: its row below those of the accepted parameters is zero.
    return np.pad(np.column_stack([accepted.jacobian, score.slope]), ((0, 1), (0, 0)))


def _tested(arrangement: Arrangement, effect: Effect | None, fit: Fit) -> Refit:
    """Test on the held-out data; what differs between repeats may settle within its prior."""
    unknowns = Unknowns.of(fit.model, arrangement.jitter, ())
    settled = calibrate(arrangement.settled, unknowns, unknowns.vanishing, fit.prediction)
    return Refit(
        effect=effect, fit=fit, held_chi2=settled.chi2 / settled.n_number,
        error=_relative(arrangement.train, fit.prediction),
        held_error=_relative(arrangement.settled, settled.prediction),
    )  # fmt: skip


def _relative(comparison: Comparison, prediction: Prediction) -> float:
    """Root mean square relative error of the fundamentals of motion, each as large as it is measured."""
    there = np.isfinite(prediction.value) & comparison.features.fundamental
    measured = comparison.observed.value[there]
    return float(np.sqrt(np.mean(np.abs(prediction.value[there] / measured - 1) ** 2)))
