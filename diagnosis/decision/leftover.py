"""What an added effect leaves unexplained: whether the model with it is good enough, or something else is there."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.candidate.effect import Effect
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import fit_effect
from diagnosis.localisation import Place, localise
from diagnosis.screening import compute_slope_gains, screen

#: Effects at most whose promise is checked by a fit.
CHECKED = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Leftover:
    """What could still be gained.

    Parameters
    ----------
    gain
        Fall of chi^2 by the best further effect: to first order, and by a fit where that would matter.
    name
        Of this effect.
    places
        Where an unknown force would explain the rest, best first.
    """

    gain: float
    name: str
    places: tuple[Place, ...]


def with_effect(arrangement: Arrangement, refit: Refit) -> Arrangement:
    """The same measurements beside the model with an effect added."""
    assert refit.effect is not None
    fit = refit.fit
    slopes = arrangement.train.slopes(fit.unknowns, fit.values, fit.model, fit.prediction)
    jacobian = np.concatenate([slopes, np.diag(1 / fit.unknowns.prior)])
    return replace(arrangement, added=(*arrangement.added, refit.effect), fit=replace(fit, jacobian=jacobian))


def find_leftover(arrangement: Arrangement, effects: Sequence[Effect], worth: float = np.inf) -> Leftover:
    """What is left once an effect was added, see `with_effect`.

    Parameters
    ----------
    arrangement
        With the effect.
    effects
        Candidates; the best few that promise more than `worth` are fitted, since the derivative of what acts through
        contacts that begin to slip promises what no fit keeps.
    worth
        Gain that matters.
    """
    gains = compute_slope_gains(arrangement, effects)
    promising = [number for number in np.argsort(-gains) if gains[number] > worth]
    for place, number in enumerate(promising):
        if place < CHECKED:
            (score,) = screen(arrangement, [effects[number]])
            gains[number] = arrangement.fit.chi2 - fit_effect(arrangement, score).chi2
        else:
            gains[number] = worth
    best = int(np.argmax(gains)) if len(gains) else -1
    return Leftover(
        gain=float(gains[best]) if best >= 0 else 0.0,
        name=effects[best].name if best >= 0 else "",
        places=tuple(localise(arrangement)),
    )
