"""Search for two missing effects, where a second effect explains the residual after the first."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from diagnosis.decision.closeness import list_beyond_priors
from diagnosis.decision.confirmation import compute_held_out_gain, raises_held_out_error
from diagnosis.decision.evidence import (
    DECISIVE,
    compute_log_density,
    compute_probabilities,
    errs_on_held_out,
    exceeds_threshold,
    find_credible,
    passes,
)
from diagnosis.decision.fits import Fits
from diagnosis.decision.pair import Pair
from diagnosis.decision.residual_explanation import ResidualExplanation
from diagnosis.decision.stand_in import MAX_SHARE_LEFT
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.threshold.detection_threshold import Thresholds


class FoundPair(NamedTuple):
    """A pair of missing effects, if one was found; or the further effect, which is to be judged alone."""

    pair: Pair | None = None
    instead: Finalist | None = None


def find_pair(fits: Fits, refit: Refit, residual: ResidualExplanation) -> FoundPair:
    """An effect, or an alternative to it, and a further effect that together explain what neither explains alone.

    Parameters
    ----------
    fits
        Computes the fits with both.
    refit, residual
        Fit with an effect alone; fits with further effects added to it, if there are any.
    """
    thresholds, further = fits.thresholds, residual.refit
    if further is None or not passes(further, thresholds):
        return FoundPair()
    pair = fits.fit_pair(refit, further)
    if not passes(pair.first.refit, thresholds):
        return FoundPair(instead=pair.alone)
    first = _choose_first(pair, thresholds)
    if first is None:
        return FoundPair()
    if first is not pair.first:
        # The new first effect is tested with the covariance of its own model, as the other one was.
        beside_it = replace(first.refit, effect=further.effect, beside=None)
        pair = fits.fit_pair(fits.finalists[first.name].refit, beside_it)
    pair = _exchange_second(fits, pair, residual.others)
    if not passes(pair.first.refit, thresholds):
        return FoundPair(instead=pair.alone)
    if not passes(pair.second.refit, thresholds):
        return FoundPair()
    gain = fits.finalists[first.name].refit.gain + pair.second.refit.gain
    if pair.force - thresholds.misfit > MAX_SHARE_LEFT * gain or _is_strained(pair.second.refit):
        return FoundPair()
    alternatives = tuple(item for item in pair.alternatives if _may_be_first(item, pair, thresholds))
    return FoundPair(pair=replace(pair, alternatives=alternatives))


def find_pair_that_passes(fits: Fits) -> FoundPair:
    """Two effects that the held-out data support, although the one with the highest density does not pass alone.

    Noise and stated errors explain the residual after both. The first fails alone because of the residual it leaves.
    """
    gaining = [item for item in fits.refits if exceeds_threshold(item, fits.thresholds)]
    first = max(gaining, key=compute_log_density, default=None)
    if first is None or fits.find_better_law(first) is not None:
        return FoundPair()
    residual = fits.explain_residual(first)
    if residual.refit is None or residual.refit.reduced_chi2_by_noise > UNEXPLAINED_CHI2:
        return FoundPair()
    result = find_pair(fits, first, residual)
    if result.pair is None:
        return result
    alone = fits.finalists[result.pair.first.name].refit
    is_worse = raises_held_out_error(result.pair.second.refit, fits.baseline)
    return FoundPair() if is_worse or compute_held_out_gain(result.pair, alone) < DECISIVE else result


def _choose_first(pair: Pair, thresholds: Thresholds) -> Finalist | None:
    """The most probable first effect of a pair; None if two effects at one place are far more probable."""
    apart = [item for item in (pair.first, *pair.alternatives) if _may_be_first(item, pair, thresholds)]
    best = max(apart, key=lambda item: compute_log_density(item.refit), default=None)
    if best is None or compute_log_density(best.refit) < compute_log_density(pair.first.refit) - DECISIVE:
        return None
    return best


def _exchange_second(fits: Fits, pair: Pair, further: Sequence[Refit]) -> Pair:
    """The pair with the most probable second effect, and those that the data cannot distinguish from it."""
    first = pair.first

    def may_be_second(second: Finalist) -> bool:
        return passes(second.refit, fits.thresholds) and _is_apart(first, second)

    listed = fits.fit_seconds(pair, further)
    best = max(filter(may_be_second, listed), key=lambda item: compute_log_density(item.refit), default=None)
    if best is None:
        return pair
    if best.name != pair.second.name or not np.array_equal(best.refit.fit.values, pair.second.refit.fit.values):
        pair = fits.fit_pair(fits.finalists[pair.first.name].refit, best.refit)
    others = [item for item in listed if item.name != best.name and may_be_second(item)]
    credible = find_credible(compute_probabilities([item.refit for item in (pair.second, *others)]))
    return replace(pair, second_alternatives=tuple(others[number - 1] for number in credible if number))


def _is_strained(refit: Refit) -> bool:
    """Whether even two effects leave a large held-out error and calibration parameters beyond their priors."""
    return errs_on_held_out(refit) and bool(list_beyond_priors(refit.fit))


def _may_be_first(first: Finalist, pair: Pair, thresholds: Thresholds) -> bool:
    """Whether an effect passes together with the second one, at another place."""
    return passes(first.refit, thresholds) and _is_apart(first, pair.second)


def _is_apart(one: Finalist, other: Finalist) -> bool:
    """Whether two effects are at different places: two at one place are one force."""
    return not (one.refit.place and one.refit.place == other.refit.place)
