r"""Which effects could explain the residual: each tried at finite strength, the accepted parameters projected out.

With J the whitened Jacobian of the accepted parameters (priors below), r the residual and d the change that an effect
makes,

.. math:: r_\perp = (I - Q Q^T) r, \qquad J = Q R, \qquad
          g = \frac{(d_\perp \cdot r_\perp)^2}{|d_\perp|^2}

is what chi^2 would fall by if the effect were linear in its strength. The derivative at zero strength says how strong
the effect would have to be; d is the difference at that strength, because derivatives mislead where a gap opens, and
differences at a strength far from it do as well. Two effects whose d_perp are parallel cannot be told apart by these
data, whatever the truth.
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
#: Least strength to try, as a share of the typical one.
LEAST = 1e-3


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
    residual = _across(basis, fit.residual)
    scores = []
    for number, (effect, slope) in enumerate(zip(effects, _slopes(arrangement, effects), strict=True)):
        scores.append(_score(arrangement, effect, basis, residual, slope))
        if report is not None:
            report(number + 1, len(effects))
    return sorted(scores, key=lambda score: -score.gain)


def accepted_basis(arrangement: Arrangement) -> Float[NDArray[np.float64], "m p"]:
    """Orthonormal basis of what the accepted parameters can do, shape (m + p, p)."""
    return np.asarray(np.linalg.qr(arrangement.fit.jacobian * arrangement.fit.unknowns.size)[0])


def _across(basis: Float[NDArray[np.float64], "m p"], vector: Vector) -> Vector:
    return np.asarray(vector - basis @ (basis.T @ vector))


def _slopes(arrangement: Arrangement, effects: Sequence[Effect]) -> Float[NDArray[np.float64], "e m"]:
    """Whitened derivative with respect to each effect's strength at none; zeros for the priors, shape (e, m + p)."""
    fit, unknowns = arrangement.fit, arrangement.unknowns(effects)
    values = np.array([*fit.values, *unknowns.vanishing[len(fit.values) :]])
    # All effects are there at once, and vanish: the states are those of the fit, with more joints that do nothing.
    model = unknowns.compose(values)
    states = arrangement.train.predict(model, fit.prediction)
    slopes = arrangement.train.slopes(unknowns, values, model, states, first=len(fit.values))
    strengths = np.cumsum([0, *(len(effect.parameters) for effect in effects)])[:-1]
    return np.concatenate([slopes[:, strengths].T, np.zeros((len(effects), len(fit.values)))], axis=1)


def _score(
    arrangement: Arrangement, effect: Effect, basis: Float[NDArray[np.float64], "m p"], residual: Vector, slope: Vector
) -> Score:
    """Look for the least chi^2 where the derivative says that it is, and at most at typical strength."""
    parameter = effect.parameters[0]
    typical = parameter.typical - parameter.vanishes
    across = _across(basis, slope)
    steepness = float(np.linalg.norm(across))
    guess = float(across @ residual) / steepness**2 if steepness * abs(typical) > UNSEEN else typical
    step = float(np.clip(guess, -abs(typical), abs(typical)))
    step = float(np.clip(step, parameter.lower - parameter.vanishes, parameter.upper - parameter.vanishes))
    if abs(step) < LEAST * abs(typical):
        step = LEAST * typical
    change = _change(arrangement, effect, parameter.vanishes + step)
    across = _across(basis, change) / step
    size = float(np.linalg.norm(across)) * abs(typical)
    if size < UNSEEN:
        nothing = np.zeros_like(across)
        return Score(effect=effect, strength=parameter.vanishes, gain=0.0, size=size, absorbed=1.0, direction=nothing)
    best = float(across @ residual) / float(across @ across)
    strength = float(np.clip(parameter.vanishes + best, parameter.lower, parameter.upper))
    moved = strength - parameter.vanishes
    gain = 2 * moved * float(across @ residual) - moved**2 * float(across @ across)
    return Score(
        effect=effect, strength=strength, gain=max(gain, 0.0), size=size,
        absorbed=1 - float(np.linalg.norm(across) * abs(step) / np.linalg.norm(change)),
        direction=across / np.linalg.norm(across) * np.sign(typical),
    )  # fmt: skip


def _change(arrangement: Arrangement, effect: Effect, strength: float) -> Vector:
    """Whitened change that an effect makes, with zeros for the priors, shape (m + p,)."""
    fit, train = arrangement.fit, arrangement.train
    rest = [each.vanishes for each in effect.parameters[1:]]
    unknowns = arrangement.unknowns([effect])
    prediction = train.predict(unknowns.compose(np.array([*fit.values, strength, *rest])), fit.prediction)
    change = np.zeros(len(fit.residual))
    moved = train.residual(fit.prediction) - train.residual(prediction)
    change[: fit.n_number] = np.where(train.found(prediction) & train.found(fit.prediction), moved, 0.0)
    return change
