r"""Which effects could explain the residual: each tried at its typical strength, the accepted parameters projected out.

With J the whitened Jacobian of the accepted parameters (priors below), r the residual and d the change that an effect
of typical strength makes,

.. math:: r_\perp = (I - Q Q^T) r, \qquad J = Q R, \qquad
          g = \frac{(d_\perp \cdot r_\perp)^2}{|d_\perp|^2}

is what chi^2 would fall by if the effect were linear in its strength. Derivatives at zero strength mislead where a gap
opens or a stop is touched: d is a difference at finite strength. Two effects whose d_perp are parallel cannot be told
apart by these data, whatever the truth.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.arrangement import Arrangement
from diagnosis.comparison import Vector
from diagnosis.effect.candidate import Effect

#: |d_perp| below which an effect of typical strength moves nothing by more than this many standard deviations in all.
UNSEEN = 0.3


@dataclass(frozen=True, kw_only=True, eq=False)
class Score:
    """How well one effect explains the residual, to first order.

    Parameters
    ----------
    effect
        Which.
    strength
        Where chi^2 would be least, within the bounds [its unit].
    gain
        By how much chi^2 would fall.
    size
        |d_perp|: standard deviations that the typical strength moves the measurements by, all taken together.
    absorbed
        Share of the effect that the accepted parameters absorb, 1 - |d_perp| / |d|.
    direction
        d_perp / |d_perp|, shape (m + p,); zero if the effect is unseen.
    """

    effect: Effect
    strength: float
    gain: float
    size: float
    absorbed: float
    direction: Vector

    @property
    def detectable(self) -> float:
        """Strength that moves the measurements by one standard deviation in all [its unit]."""
        parameter = self.effect.parameters[0]
        return abs(parameter.typical - parameter.vanishes) / self.size if self.size else np.inf


def screen(
    arrangement: Arrangement, effects: Sequence[Effect], report: Callable[[int, int], None] | None = None
) -> list[Score]:
    """Score effects, best first.

    Parameters
    ----------
    arrangement
        Calibrated.
    effects
        Candidates.
    report
        Called with the number done and the number of all.
    """
    fit = arrangement.fit
    basis = accepted_basis(arrangement)
    residual = fit.residual - basis @ (basis.T @ fit.residual)
    scores = []
    for number, effect in enumerate(effects):
        scores.append(_score(arrangement, effect, basis, residual))
        if report is not None:
            report(number + 1, len(effects))
    return sorted(scores, key=lambda score: -score.gain)


def accepted_basis(arrangement: Arrangement) -> Float[NDArray[np.float64], "m p"]:
    """Orthonormal basis of what the accepted parameters can do, shape (m + p, p)."""
    return np.asarray(np.linalg.qr(arrangement.fit.jacobian * arrangement.fit.unknowns.size)[0])


def _score(
    arrangement: Arrangement, effect: Effect, basis: Float[NDArray[np.float64], "m p"], residual: Vector
) -> Score:
    fit, parameter = arrangement.fit, effect.parameters[0]
    unknowns = arrangement.unknowns([effect])
    rest = [each.vanishes for each in effect.parameters[1:]]
    prediction = arrangement.train.predict(
        unknowns.compose(np.array([*fit.values, parameter.typical, *rest])), fit.prediction
    )
    change = np.zeros(len(residual))
    m = len(residual) - len(fit.values)
    moved = arrangement.train.residual(fit.prediction) - arrangement.train.residual(prediction)
    change[:m] = np.where(arrangement.train.found(prediction) & arrangement.train.found(fit.prediction), moved, 0.0)
    across = change - basis @ (basis.T @ change)
    size, whole = float(np.linalg.norm(across)), float(np.linalg.norm(change))
    if size < UNSEEN:
        return Score(
            effect=effect, strength=parameter.vanishes, gain=0.0, size=size, absorbed=1.0, direction=0 * across
        )
    step = parameter.typical - parameter.vanishes
    best = parameter.vanishes + step * float(across @ residual) / size**2
    strength = float(np.clip(best, parameter.lower, parameter.upper))
    share = (strength - parameter.vanishes) / step
    gain = 2 * share * float(across @ residual) - share**2 * size**2
    return Score(
        effect=effect, strength=strength, gain=max(gain, 0.0), size=size, absorbed=1 - size / whole,
        direction=across / size,
    )  # fmt: skip
