r"""Screening of effects: each at finite strength against the residual, with the calibration parameters projected out.

With J the whitened Jacobian of the calibration parameters (rows of the priors below), r the residual and d the change
by an effect,

.. math:: r_\perp = (I - Q Q^T) r, \qquad J = Q R, \qquad
          g = \frac{(d_\perp \cdot r_\perp)^2}{|d_\perp|^2}

is the fall of chi^2 for an effect that is linear in its strength. d is either the derivative at the neutral strength,
or a difference quotient at the strength that the derivative predicts, limited to the typical one. The one with the
larger g is used: the derivative is misleading where a gap opens, the difference quotient if its strength is far from
the true one. An effect on joints whose derivative is zero, such as the gap of a contact that never touches, is tried
on both sides at the typical strength and far from it. Two effects with parallel d_perp are indistinguishable in these
data.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.candidate.effect import Effect, changes_joints
from diagnosis.candidate.far_strength import list_far_strengths
from diagnosis.fit.calibration import Matrix, Vector
from diagnosis.fit.fit_parameter import make_start
from diagnosis.fit.problem import Screened
from hbsolve.errors import ModelError

#: Least strength to try, as a share of the typical one.
MIN_STRENGTH = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Score:
    """First-order estimate of how well one effect explains the residual.

    Parameters
    ----------
    effect
        Effect.
    strength
        Strength that minimises chi^2 within the bounds [its unit].
    gain
        Fall of chi^2 at this strength [-].
    size
        |d_perp|: change of all measurements together by the typical strength [standard deviations].
    absorbed
        Share of the effect that the calibration parameters absorb, 1 - |d_perp| / |d| [-].
    direction
        d_perp / |d_perp|, shape (m + p,); zero if the effect is invisible.
    begins
        Distance from the neutral strength at which an effect without a derivative was tried: it may have no effect at
        smaller ones; 0 if the change is linear [its unit].
    start, slope
        Start of a refit: fitted values that compensate for the effect, then its parameters, shape (p + e,); whitened
        derivative of the effect at its neutral value, shape (m + p,).
    """

    effect: Effect
    strength: float
    gain: float
    size: float
    absorbed: float
    direction: Vector
    start: Vector
    slope: Vector
    begins: float = 0.0

    @property
    def detectable(self) -> float:
        """Strength that changes all measurements together by one standard deviation, by a linear change [its unit]."""
        parameter = self.effect.parameters[0]
        return abs(parameter.typical - parameter.vanishes) / self.size if self.size else np.inf


def screen(
    problem: Screened, effects: Sequence[Effect], report: Callable[[int, int], None] | None = None
) -> list[Score]:
    """Scores of effects, best first.

    Parameters
    ----------
    problem
        Data and calibrated model.
    effects
        Candidates.
    report
        Called with the number of screened effects and the total number.
    """
    fit = problem.fit
    basis = make_calibration_basis(problem)
    residual = project_out(basis, fit.residual)
    scores = []
    for number, (effect, slope) in enumerate(zip(effects, compute_slopes(problem, effects), strict=True)):
        scores.append(_score(problem, effect, basis, residual, slope))
        if report is not None:
            report(number + 1, len(effects))
    return sorted(scores, key=lambda score: -score.gain)


def compute_slope_gains(problem: Screened, effects: Sequence[Effect]) -> Vector:
    """Gain of each effect by its derivative at the neutral value, within its bounds, shape (e,)."""
    basis = make_calibration_basis(problem)
    residual = project_out(basis, problem.fit.residual)
    slopes = compute_slopes(problem, effects)
    return np.array(
        [
            minimise_along_change(effect, project_out(basis, slope), residual).gain
            for effect, slope in zip(effects, slopes, strict=True)
        ]
    )


def make_calibration_basis(problem: Screened) -> Matrix:
    """Orthonormal basis of the changes by the calibration parameters, shape (m + p, p)."""
    return make_basis(problem.fit.jacobian * problem.fit.unknowns.size)


def make_basis(changes: Matrix) -> Matrix:
    """Orthonormal basis of the nonzero columns."""
    return np.asarray(np.linalg.qr(changes[:, changes.any(axis=0)])[0])


def project_out(basis: Matrix, changes: Float[NDArray[np.float64], "m ..."]) -> Float[NDArray[np.float64], "m ..."]:
    """Project a basis out of one change, or of several columns."""
    return np.asarray(changes - basis @ (basis.T @ changes))


def compute_slopes(problem: Screened, effects: Sequence[Effect]) -> Iterator[Vector]:
    """Whitened derivative with respect to each effect's strength at its neutral value, shape (m + p,) each."""
    fit = problem.fit
    # All effects are applied at once with their neutral values, so that the states are those of the fit.
    for group in [effects] if problem.selection.slopes_at_once else [[item] for item in effects]:
        unknowns = problem.unknowns(group)
        values = np.array([*fit.values, *unknowns.vanishing[len(fit.values) :]])
        model = unknowns.compose(values)
        states = problem.train.predict(model, fit.prediction, fit.starts)
        slopes = problem.train.slopes(unknowns, values, model, states, first=len(fit.values))
        strengths = np.cumsum([0, *(len(effect.parameters) for effect in group)])[:-1]
        yield from np.concatenate([slopes[:, strengths].T, np.zeros((len(group), len(fit.values)))], axis=1)


def _score(problem: Screened, effect: Effect, basis: Matrix, residual: Vector, slope: Vector) -> Score:
    """Score by the derivative, then by differences at other strengths."""
    parameter, selection = effect.parameters[0], problem.selection
    typical = parameter.typical - parameter.vanishes
    whole = float(np.linalg.norm(slope))
    across = project_out(basis, slope)
    absorbed = 1 - float(np.linalg.norm(across)) / whole if whole else 0.0
    is_absorbed = 1 - absorbed < selection.least_unabsorbed_share
    if is_absorbed or whole * abs(typical) < selection.least_change:
        slope, across = 0 * slope, 0 * across
    tried = minimise_along_change(effect, across, residual)
    rates = _compute_compensation_rates(problem, slope)
    for step in [] if is_absorbed else _list_finite_steps(problem, effect, tried, has_derivative=bool(whole)):
        change = project_out(basis, _change(problem, effect, step, rates)) / step
        finite = minimise_along_change(effect, change, residual, begins=0.0 if whole else step)
        if finite.across.any() and (finite.gain > tried.gain or not tried.across.any()):
            tried = finite
    size = float(np.linalg.norm(tried.across))
    start = _compensate_values(problem, effect, tried.step, rates)
    if not size or size * abs(typical) < selection.least_change:
        return Score(
            effect=effect, strength=parameter.vanishes, gain=0.0, size=size * abs(typical),
            absorbed=absorbed if is_absorbed else 1.0,
            direction=np.zeros_like(residual), start=start, slope=slope,
        )  # fmt: skip
    return Score(
        effect=effect, strength=parameter.vanishes + tried.step, gain=tried.gain, size=size * abs(typical),
        absorbed=absorbed, direction=tried.across / size * np.sign(typical), start=start,
        slope=slope, begins=abs(tried.begins),
    )  # fmt: skip


def _list_finite_steps(problem: Screened, effect: Effect, tried: "LineMinimum", *, has_derivative: bool) -> list[float]:
    """Steps of difference quotients: the one by the derivative, at most as large as the typical one.

    An effect on joints whose derivative is exactly zero may begin beyond some strength, on one side alone: typical and
    far steps on both sides. Calibration parameters do not compensate for these.
    """
    parameter = effect.parameters[0]
    typical = parameter.typical - parameter.vanishes
    if has_derivative or not changes_joints(effect, problem.fit.model):
        steps = np.clip([tried.step if tried.across.any() else typical], -abs(typical), abs(typical))
    else:
        steps = np.array([typical, -typical, *(list_far_strengths(parameter).ravel() - parameter.vanishes)])
    steps = np.clip(steps, parameter.lower - parameter.vanishes, parameter.upper - parameter.vanishes)
    return [float(step) for step in dict.fromkeys(steps) if MIN_STRENGTH * abs(typical) < abs(step) < np.inf]


class LineMinimum(NamedTuple):
    """Minimum of chi^2 along a change per unit of strength: the change, the step to the minimum, the fall of chi^2.

    `begins` is the step of a change that may vanish at smaller steps; 0 if the change is linear.
    """

    across: Vector
    step: float
    gain: float
    begins: float = 0.0


def minimise_along_change(effect: Effect, across: Vector, residual: Vector, begins: float = 0.0) -> LineMinimum:
    """Minimise chi^2 along a change per unit of strength, shape (n,), within the bounds of an effect.

    With `begins`, the step at which an effect was tried that may act on one side alone, on this side.
    """
    parameter, steepness = effect.parameters[0], float(across @ across)
    if not steepness:
        return LineMinimum(across, 0.0, 0.0, begins)
    lower = 0.0 if begins > 0 else parameter.lower - parameter.vanishes
    upper = 0.0 if begins < 0 else parameter.upper - parameter.vanishes
    step = float(np.clip(float(across @ residual) / steepness, lower, upper))
    gain = max(2 * step * float(across @ residual) - step**2 * steepness, 0.0)
    return LineMinimum(across, step, gain, begins)


def _change(problem: Screened, effect: Effect, step: float, rates: Vector) -> Vector:
    """Whitened change by an effect with compensating calibration parameters, shape (m + p,).

    Without compensation, the curvature due to a mere shift of the resonance would dominate the change.
    """
    fit, train = problem.fit, problem.train
    values = _compensate_values(problem, effect, step, rates)
    try:
        unknowns = problem.unknowns([effect])
        prediction = train.predict(unknowns.compose(values), fit.prediction, values[: unknowns.n_start])
    except ModelError:
        # With this strength the structure is not supported: the effect cannot be the missing one.
        return np.zeros(len(fit.residual))
    moved = fit.residual[: fit.n_number] - train.residual(prediction)
    there = train.has_prediction(prediction) & train.has_prediction(fit.prediction)
    prior = (values[: len(fit.values)] - fit.values) / fit.unknowns.prior
    return np.concatenate([np.where(there, moved, 0.0), prior])


def _compute_compensation_rates(problem: Screened, slope: Vector) -> Vector:
    """Change of the fitted values that best compensates for an effect of unit strength, shape (p,)."""
    return np.asarray(-np.linalg.lstsq(problem.fit.jacobian, slope, rcond=1e-12)[0])


def _compensate_values(problem: Screened, effect: Effect, step: float, rates: Vector) -> Vector:
    """Fitted values that best compensate for an effect, then the parameters of the effect, shape (p + e,)."""
    strength = effect.parameters[0].vanishes + step
    fitted = problem.fit.values + rates * step
    return problem.unknowns([effect]).clipped(make_start(fitted, effect, strength))
