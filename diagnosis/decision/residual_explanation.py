"""Explanations of the residual after an effect: further effects, and places of unknown forces."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.candidate.effect import Effect
from diagnosis.decision.evidence import compute_log_density
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration import Fit
from diagnosis.fit.finalist import compare
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import fit_quickly
from diagnosis.model_error_share import compute_gains_by_covariance
from diagnosis.screening import screen
from diagnosis.unknown_force import UnknownForce, find_unknown_forces

#: Largest number of effects whose linear gain is checked by a fit.
MAX_FURTHER_FITS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class ResidualExplanation:
    """Gains of further effects and unknown forces when added to an effect.

    Parameters
    ----------
    gain
        Fall of chi^2 by the best further effect: from a fit if the linear gain exceeds the threshold, else linear [-].
    effect_name
        Name of the best further effect.
    places
        Places where an unknown force would explain the residual, best first.
    known_effect_gain
        Largest gain of a known effect with the covariances of `places`, to first order [-].
    refit
        Fit with the further effect that has the highest density of all data, if any was fitted and gains.
    others
        Fits with other further effects added to the first one.
    """

    gain: float
    effect_name: str
    places: tuple[UnknownForce, ...]
    known_effect_gain: float
    refit: Refit | None = None
    others: tuple[Refit, ...] = ()


def add_effect(arrangement: Arrangement, refit: Refit) -> Arrangement:
    """Arrangement of the same measurements with an effect added to the model."""
    assert refit.effect is not None
    fit = refit.fit
    slopes = arrangement.train.slopes(fit.unknowns, fit.values, fit.model, fit.prediction)
    jacobian = np.concatenate([slopes, np.diag(1 / fit.unknowns.prior)])
    return replace(arrangement, added=(*arrangement.added, refit.effect), fit=replace(fit, jacobian=jacobian))


def explain_residual(arrangement: Arrangement, effects: Sequence[Effect], threshold: float) -> ResidualExplanation:
    """Explanations of the residual of an arrangement to which an effect was added, see `add_effect`.

    Parameters
    ----------
    arrangement
        Arrangement with the effect.
    effects
        Candidates. The best few with a linear gain above `threshold` are fitted: for contacts at the onset of slip the
        linear gain may be far too large.
    threshold
        Linear gain above which an effect is fitted [-].
    """
    by_covariance = compute_gains_by_covariance(arrangement, effects)
    gains, fits = by_covariance.max(axis=0, initial=0.0), dict[int, Fit]()
    promising = [number for number in np.argsort(-gains).tolist() if gains[number] > threshold]
    for place, number in enumerate(promising):
        if place < MAX_FURTHER_FITS:
            (score,) = screen(arrangement, [effects[number]])
            fits[number] = fit_quickly(arrangement, score)
            gains[number] = arrangement.cost - arrangement.cost_with_error_left(fits[number])
        else:
            gains[number] = threshold
    best = int(np.argmax(gains)) if len(gains) else -1
    refits = list[Refit]()
    if best in fits:
        without = arrangement.tested(None, arrangement.fit)
        tested = [(arrangement.tested(effects[number], fit), float(gains[number])) for number, fit in fits.items()]
        refits = sorted((compare(item, without, gain) for item, gain in tested), key=compute_log_density)
    return ResidualExplanation(
        gain=float(gains[best]) if best >= 0 else 0.0,
        effect_name=effects[best].name if best >= 0 else "",
        places=tuple(find_unknown_forces(arrangement)),
        known_effect_gain=float(by_covariance.max(initial=0.0)),
        refit=refits[-1] if refits else None,
        others=tuple(refits[:-1]),
    )
