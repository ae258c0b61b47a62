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
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.effect.candidate import Effect
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.comparison import Vector
from hbsolve.errors import ModelError

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
    start, slope
        Where a refit begins: the fitted values that make up for the effect, then its own, shape (p + e,); and its
        whitened derivative at none, shape (m + p,).
    """

    effect: Effect
    strength: float
    gain: float
    size: float
    absorbed: float
    direction: Vector
    start: Vector
    slope: Vector

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


def slope_gains(arrangement: Arrangement, effects: Sequence[Effect]) -> Vector:
    """Gain of each effect by its derivative at none alone, within its bounds, shape (e,)."""
    basis = accepted_basis(arrangement)
    residual = _across(basis, arrangement.fit.residual)
    slopes = _slopes(arrangement, effects)
    return np.array(
        [_least(effect, _across(basis, slope), residual).gain for effect, slope in zip(effects, slopes, strict=True)]
    )


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
    whole = float(np.linalg.norm(slope))
    across = _across(basis, slope)
    absorbed = 1 - float(np.linalg.norm(across)) / whole if whole else 1.0
    if whole * abs(typical) < UNSEEN:
        slope, across = 0 * slope, 0 * across
    tried = _least(effect, across, residual)
    relief = _relief(arrangement, slope)
    step = float(np.clip(tried.step if across.any() else typical, -abs(typical), abs(typical)))
    step = float(np.clip(step, parameter.lower - parameter.vanishes, parameter.upper - parameter.vanishes))
    if abs(step) > LEAST * abs(typical):
        change = _change(arrangement, effect, step, relief)
        finite = _least(effect, _across(basis, change) / step, residual)
        if finite.gain >= tried.gain or not across.any():
            tried = finite
    size = float(np.linalg.norm(tried.across))
    start = _made_up(arrangement, effect, tried.step, relief)
    if size * abs(typical) < UNSEEN:
        return Score(
            effect=effect, strength=parameter.vanishes, gain=0.0, size=size * abs(typical), absorbed=1.0,
            direction=np.zeros_like(residual), start=start, slope=slope,
        )  # fmt: skip
    return Score(
        effect=effect, strength=parameter.vanishes + tried.step, gain=tried.gain, size=size * abs(typical),
        absorbed=absorbed, direction=tried.across / size * np.sign(typical), start=start, slope=slope,
    )  # fmt: skip


class _Least(NamedTuple):
    """The least chi^2 along a change: per unit of strength, how far, and by how much chi^2 falls."""

    across: Vector
    step: float
    gain: float


def _least(effect: Effect, across: Vector, residual: Vector) -> _Least:
    parameter, steepness = effect.parameters[0], float(across @ across)
    if not steepness:
        return _Least(across, 0.0, 0.0)
    step = float(across @ residual) / steepness
    step = float(np.clip(step, parameter.lower - parameter.vanishes, parameter.upper - parameter.vanishes))
    return _Least(across, step, max(2 * step * float(across @ residual) - step**2 * steepness, 0.0))


def _change(arrangement: Arrangement, effect: Effect, step: float, relief: Vector) -> Vector:
    """Whitened change that an effect makes while the accepted parameters make up for what they can, shape (m + p,).

    Without that, a resonance that merely shifts would move the measurements so far that all else is lost in the
    curvature of this shift.
    """
    fit, train = arrangement.fit, arrangement.train
    values = _made_up(arrangement, effect, step, relief)
    try:
        prediction = train.predict(arrangement.unknowns([effect]).compose(values), fit.prediction)
    except ModelError:
        # Nothing holds a structure with so much of it: it cannot be what is missing.
        return np.zeros(len(fit.residual))
    moved = fit.residual[: fit.n_number] - train.residual(prediction)
    there = train.found(prediction) & train.found(fit.prediction)
    prior = (values[: len(fit.values)] - fit.values) / fit.unknowns.prior
    return np.concatenate([np.where(there, moved, 0.0), prior])


def _relief(arrangement: Arrangement, slope: Vector) -> Vector:
    """Change of the fitted values that makes up for as much as it can of an effect of unit strength, shape (p,)."""
    return np.asarray(-np.linalg.lstsq(arrangement.fit.jacobian, slope, rcond=1e-12)[0])


def _made_up(arrangement: Arrangement, effect: Effect, step: float, relief: Vector) -> Vector:
    """Fitted values that make up for as much of an effect as they can, and its own, shape (p + e,)."""
    strength = effect.parameters[0].vanishes + step
    rest = [each.vanishes for each in effect.parameters[1:]]
    fitted = arrangement.fit.values + relief * step
    return arrangement.unknowns([effect]).clipped(np.array([*fitted, strength, *rest]))
