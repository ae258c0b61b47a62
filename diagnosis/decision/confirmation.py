"""Whether the held-out data confirm an effect, alone or with a further one that is missing as well."""

import numpy as np

from diagnosis.decision.closeness import list_beyond_priors
from diagnosis.decision.evidence import DECISIVE
from diagnosis.decision.pair import Pair
from diagnosis.effect import find_kind
from diagnosis.fit.problem import Refit

#: Rise of a relative error that is none: an effect on forces moves it, too [-].
ERROR_TOLERANCE = 0.01


def is_confirmed(refit: Refit, alone: Refit, pair: Pair | None, baseline: Refit) -> bool:
    """Whether the held-out data confirm an effect, or the pair of it and a further one.

    Their density must rise decisively. Neither with the effect alone nor with the pair may their reduced chi-squared by
    noise rise, nor their relative error where noise does not explain it. An effect that takes mass or stiffness away is
    not confirmed, since errors of a model do so as well; nor is one whose fit has a calibration parameter at a bound.

    Parameters
    ----------
    refit, alone
        Fit with the effect, and the further one if there is; and with the effect alone.
    pair
        Fits with a further effect, if there is.
    baseline
        Fit without an effect.
    """
    both = [refit] if pair is None else [refit, pair.second.refit]
    held_out_gain = refit.held_out_gain if pair is None else compute_held_out_gain(pair, alone)
    is_strained = list_beyond_priors(refit.fit) or any(map(takes_away, both))
    is_worse = raises_held_out_error(refit, baseline) or raises_held_out_error(alone, baseline)
    return bool(held_out_gain >= DECISIVE and not is_worse and not is_strained)


def compute_held_out_gain(pair: Pair, alone: Refit) -> float:
    """Fall of -2 ln p of the held-out data by two effects: by the first alone, and by the second beside it [-]."""
    return alone.held_out_gain + pair.second.refit.held_out_gain


def raises_held_out_error(refit: Refit, baseline: Refit) -> bool:
    """Whether held-out data are further off with an effect; chi^2 within a standard deviation is noise."""
    if refit.held_out_reduced_chi2_by_noise <= 1 + np.sqrt(2 / max(refit.n_held_out, 1)):
        return False
    is_larger = refit.held_out_error > (1 + ERROR_TOLERANCE) * baseline.held_out_error
    return bool(is_larger or refit.held_out_reduced_chi2_by_noise > baseline.held_out_reduced_chi2_by_noise)


def takes_away(refit: Refit) -> bool:
    """Whether an effect takes a part away from the structure that the model has."""
    kind = None if refit.effect is None else find_kind(refit.effect)
    return kind is not None and kind.is_addition and refit.strength < 0
