"""Whether the held-out data confirm an effect, alone or together with a second missing effect."""

import numpy as np

from diagnosis.decision.closeness import list_beyond_priors
from diagnosis.decision.evidence import DECISIVE
from diagnosis.decision.pair import Pair
from diagnosis.effect import find_kind
from diagnosis.fit.problem import Refit

#: Rise of a relative error that is ignored: an effect on forces changes this error too [-].
ERROR_TOLERANCE = 0.01


def is_confirmed(refit: Refit, alone: Refit, pair: Pair | None, baseline: Refit) -> bool:
    """Whether the held-out data confirm an effect, or a pair of effects.

    The density of the held-out data must rise decisively. Their reduced chi-squared by noise must not rise, with the
    effect alone or with the pair; nor must their relative error, unless noise explains it. An effect that removes mass
    or stiffness is not confirmed, because model errors do the same. Nor is an effect whose fit has calibration
    parameters beyond their priors.

    Parameters
    ----------
    refit, alone
        Fit with the effect (and the second one of a pair); fit with the effect alone.
    pair
        Fits with a second effect, if there is one.
    baseline
        Fit without an effect.
    """
    both = [refit] if pair is None else [refit, pair.second.refit]
    held_out_gain = refit.held_out_gain if pair is None else compute_held_out_gain(pair, alone)
    is_strained = list_beyond_priors(refit.fit) or any(map(takes_away, both))
    is_worse = raises_held_out_error(refit, baseline) or raises_held_out_error(alone, baseline)
    return bool(held_out_gain >= DECISIVE and not is_worse and not is_strained)


def compute_held_out_gain(pair: Pair, alone: Refit) -> float:
    """Fall of -2 ln p of the held-out data by two effects: the first alone, plus the second added to it [-]."""
    return alone.held_out_gain + pair.second.refit.held_out_gain


def raises_held_out_error(refit: Refit, baseline: Refit) -> bool:
    """Whether an effect raises the held-out error; chi^2 within one standard deviation of its mean counts as noise."""
    if refit.held_out_reduced_chi2_by_noise <= 1 + np.sqrt(2 / max(refit.n_held_out, 1)):
        return False
    is_larger = refit.held_out_error > (1 + ERROR_TOLERANCE) * baseline.held_out_error
    return bool(is_larger or refit.held_out_reduced_chi2_by_noise > baseline.held_out_reduced_chi2_by_noise)


def takes_away(refit: Refit) -> bool:
    """Whether an effect removes mass, stiffness or another part that the model contains."""
    kind = None if refit.effect is None else find_kind(refit.effect)
    return kind is not None and kind.is_addition and refit.strength < 0
