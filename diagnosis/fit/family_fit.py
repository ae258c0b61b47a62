r"""Calibration onto families: parameters whose bands contain the measured families as tightly as possible.

The score of a model requires the sampled bands of all levels, and has kinks: a simplex search in eight parameters
fails. The limits at the readings are smooth. In each iteration they are linearised about the best parameters (the
logarithms of amplitudes), and the score of these limits, with a prior of standard deviations sigma around zero,

.. math:: C(l_0 + L \,\Delta s) + \sum_j \frac{s_j^2}{2 \sigma_j^2}, \qquad |\Delta s_i| \le r,

is minimised within a trust region of radius r, which grows after a good prediction and shrinks after a poor one. This
takes a fraction of a second, the bands of one model take seconds. Parameters are scaled to steps of significant size.

References
----------
J. Nocedal and S. J. Wright, Numerical Optimization (2006), chapter 4, for the trust region.
M. J. D. Powell, The Computer Journal 7 (1964), 155-162, and J. A. Nelder and R. Mead, The Computer Journal 7 (1965),
308-313, for the searches within it.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy.optimize
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.fit.family_target import LEAST_WIDTH, FamilyLimits, FamilyTarget
from geometry.errors import InputError
from hbsolve.errors import NoSteadyState

Values = Float[NDArray[np.float64], " p"]
#: Standard deviations of a prior, or one for all parameters [steps].
Prior = Values | float
#: Limits at some parameters; raises `InputError` or `NoSteadyState` if there is no such model.
ComputeLimits = Callable[[Values], FamilyLimits]
#: Limits at each of some parameters, in their order; None where there is no such model, or no steady state of it.
ComputeEach = Callable[[Iterable[Values]], Iterable[FamilyLimits | None]]
#: The built-in `map`, or one over processes, such as by `pipeline.pool.make_map`.
MapOver = Callable[..., Iterable[Any]]

#: Initial and largest radius of the trust region, and radius at which the fit ends [steps].
FIRST_RADIUS, MOST_RADIUS, LAST_RADIUS = 1.5, 5.0, 0.05
#: Ratio of actual to predicted fall of the score above which the region grows, and below which it shrinks [-].
GOOD_SHARE, POOR_SHARE = 0.7, 0.3
GROW, SHRINK = 2.0, 0.4
#: Step of a difference quotient over the radius [-], and its largest value [steps]; slopes are computed again when this
#: step exceeds the last share of a shrunk radius [-].
SLOPE_SHARE, MOST_SLOPE, WIDE_SLOPE_SHARE = 0.2, 0.3, 0.6
#: Least fall of the score, where 1.92 is the end of a 95 % interval [-].
LEAST_FALL = 0.02
UNBOUNDED = scipy.optimize.Bounds()
#: Powell's method and a simplex alternate within the region, as long as the simplex gains this share of `LEAST_FALL`:
#: both stop at kinks, but seldom at the same ones. First size of the simplex over the radius, largest number of rounds,
#: largest number of evaluations of one search [-].
GAIN_SHARE, SIMPLEX_SHARE, MOST_ROUNDS, MOST_LINEAR = 0.2, 0.1, 4, 2000


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearLimits:
    """Limits at the n readings of a target, linearised in p parameters; amplitudes and deviations as logarithms.

    Parameters
    ----------
    target
        Readings.
    at
        Parameters about which the limits are linearised, shape (p,) [steps].
    value, slopes
        Limits and deviations at these parameters, and their slopes, shapes (2, 2, n) and (p, 2, 2, n).
    """

    target: FamilyTarget
    at: Values
    value: Float[NDArray[np.float64], "2 2 n"]
    slopes: Float[NDArray[np.float64], "p 2 2 n"]

    @classmethod
    def differentiate(
        cls,
        target: FamilyTarget,
        compute_each: ComputeEach,
        at: Values,
        limits: FamilyLimits,
        step: float,
        bounds: scipy.optimize.Bounds = UNBOUNDED,
    ) -> "LinearLimits":
        """By central differences: limits at a resonance are curved, and one-sided differences mislead the fit.

        If there is no model on one side, or no limit at a reading, the difference to the other side is used alone.

        Parameters
        ----------
        target
            Readings.
        compute_each
            Limits at each of some parameters.
        at
            Parameters about which to differentiate, shape (p,) [steps].
        limits
            Limits at these parameters.
        step
            Difference of each parameter [steps].
        bounds
            Bounds of the parameters, shapes (p,) [steps].
        """
        value = _to_linear(target, limits)
        total, count = np.zeros((2, len(at), *value.shape))
        signed_step = np.array([step, -step])
        moved = at + signed_step[:, None, None] * np.eye(len(at))
        is_within = ((moved >= bounds.lb) & (moved <= bounds.ub)).all(axis=-1)
        for (side, number), moved_limits in zip(np.argwhere(is_within), compute_each(moved[is_within]), strict=True):
            if moved_limits is not None:
                slope = (_to_linear(target, moved_limits) - value) / signed_step[side]
                total[number] += np.where(np.isfinite(slope), slope, 0.0)
                count[number] += np.isfinite(slope)
        return cls(target=target, at=at, value=value, slopes=total / np.maximum(count, 1))

    def with_limits(self, limits: FamilyLimits) -> "LinearLimits":
        """Other limits at the same parameters, with the slopes of these."""
        return replace(self, value=_to_linear(self.target, limits))

    def score(self, scaled: Values) -> float:
        """Score of the limits at other parameters, without a prior."""
        moved = self.value + np.tensordot(scaled - self.at, self.slopes, axes=1)
        value = np.where(self.target.is_amplitude, np.exp(moved[0]), moved[0])
        return self.target.score(FamilyLimits(np.sort(value, axis=0), np.exp(moved[1])))


def _to_linear(target: FamilyTarget, limits: FamilyLimits) -> Float[NDArray[np.float64], "2 2 n"]:
    least = np.maximum(LEAST_WIDTH * np.abs(target.value), np.finfo(float).tiny)
    value = np.where(target.is_amplitude, np.log(np.maximum(limits.value, least)), limits.value)
    return np.array([value, np.log(np.maximum(limits.deviation, least))])


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyFit:
    """Result of a calibration onto families.

    Parameters
    ----------
    values
        Parameters, shape (p,) [unit of each, or steps].
    before, after
        Score including the prior at the start and at the end [-].
    n_evaluation
        Models whose bands were sampled [-].
    """

    values: Values
    before: float
    after: float
    n_evaluation: int


def fit_limits(
    compute: ComputeLimits,
    target: FamilyTarget,
    prior: Prior,
    start: Values,
    *,
    most: int,
    bounds: scipy.optimize.Bounds = UNBOUNDED,
    report: Callable[[float, float], None] | None = None,
    map_over: MapOver = map,
) -> FamilyFit:
    """Minimise the score of limits and a prior by linearised limits in a trust region.

    Parameters
    ----------
    compute
        Limits at some parameters.
    target
        Readings, and the score of limits.
    prior
        Standard deviation of each parameter around zero, one for all or shape (p,) [steps].
    start
        Parameters to start from, shape (p,) [steps].
    most
        Largest number of evaluations; the last iteration is finished [-].
    bounds
        Bounds of the parameters, shapes (p,) [steps].
    report
        Called with the number of evaluations, and their largest number [-].
    map_over
        `map`, or one over processes, which then take `compute`: the models of a difference quotient are independent.

    Raises
    ------
    InputError, NoSteadyState
        There is no model to start from.
    """
    n_evaluation = 0

    def advance() -> None:
        nonlocal n_evaluation
        n_evaluation += 1
        if report is not None:
            report(min(n_evaluation, most), most)

    def compute_each(moved: Iterable[Values]) -> Iterator[FamilyLimits | None]:
        for limits in map_over(partial(compute_if_possible, compute), moved):
            advance()
            yield limits

    best, radius, linear, step = start, FIRST_RADIUS, None, 0.0
    limits = compute(best)
    advance()
    before = least = target.score(limits) + compute_prior(best, prior)
    while radius > LAST_RADIUS and n_evaluation < most:
        if linear is None or step > WIDE_SLOPE_SHARE * radius:
            step = min(SLOPE_SHARE * radius, MOST_SLOPE)
            linear = LinearLimits.differentiate(target, compute_each, best, limits, step, bounds)
        trial = minimise_linear(linear, prior, best, radius, bounds)
        predicted = least - linear.score(trial) - compute_prior(trial, prior)
        if not predicted >= LEAST_FALL:
            break
        trial_limits = compute_if_possible(compute, trial)
        advance()
        gain = -np.inf if trial_limits is None else least - target.score(trial_limits) - compute_prior(trial, prior)
        if trial_limits is not None and gain > 0:
            best, limits, least, linear = trial, trial_limits, least - gain, None
        if not gain >= POOR_SHARE * predicted:
            radius *= SHRINK
        elif gain > GOOD_SHARE * predicted:
            radius = min(GROW * radius, MOST_RADIUS)
    return FamilyFit(values=best, before=before, after=least, n_evaluation=n_evaluation)


def minimise_linear(
    linear: LinearLimits,
    prior: Prior,
    start: Values,
    radius: float,
    bounds: scipy.optimize.Bounds = UNBOUNDED,
) -> Values:
    """Parameters that minimise the score of linear limits within a radius about a start, shape (p,) [steps]."""
    lower, upper = np.maximum(bounds.lb, start - radius), np.minimum(bounds.ub, start + radius)
    free = upper > lower
    fixed = np.clip(start, lower, upper)

    def compose(moved: Values) -> Values:
        whole = fixed.copy()
        whole[free] = moved
        return whole

    def cost(moved: Values) -> float:
        scaled = compose(moved)
        return linear.score(scaled) + compute_prior(scaled, prior)

    within = list(zip(lower[free].tolist(), upper[free].tolist(), strict=True))

    def search(begin: Values, least: float, method: Any, **more: Any) -> tuple[Values, float]:
        options: Any = {"maxfev": MOST_LINEAR, **more}
        result = scipy.optimize.minimize(cost, begin, method=method, bounds=within, options=options)
        reached = np.clip(result.x, lower[free], upper[free])
        return (reached, float(result.fun)) if result.fun < least else (begin, least)

    best, size = fixed[free], SIMPLEX_SHARE * radius
    least = cost(best)
    for _ in range(MOST_ROUNDS):
        best, by_lines = search(best, least, "Powell")
        away = np.where(best + size < upper[free], size, -size)
        best, least = search(best, by_lines, "Nelder-Mead", initial_simplex=np.vstack([best, best + np.diag(away)]))
        if not by_lines - least > GAIN_SHARE * LEAST_FALL:
            break
    return compose(best)


def fit_families(
    compose: Callable[[Values], Model],
    calibration_parameters: Sequence[CalibrationParameter],
    start: Values,
    target: FamilyTarget,
    *,
    most: int = 150,
    report: Callable[[float, float], None] | None = None,
) -> FamilyFit:
    """Fit calibration parameters to families, starting from a fit to the mean.

    Parameters
    ----------
    compose
        Model for given values of the parameters, with the sensors of the families.
    calibration_parameters
        Parameters with priors centred at their neutral values.
    start
        Values to start from, shape (p,) [unit of each].
    target
        Families, and the score of a model.
    most
        Largest number of evaluations [-].
    report
        Called with the number of evaluations, and their largest number [-].

    Raises
    ------
    InputError, NoSteadyState
        There is no model to start from.
    """
    centre = np.array([item.parameters[0].vanishes for item in calibration_parameters])
    deviation = np.array([item.deviation for item in calibration_parameters])
    lower = np.array([item.parameters[0].lower for item in calibration_parameters])
    upper = np.array([item.parameters[0].upper for item in calibration_parameters])

    def compute(scaled: Values) -> FamilyLimits:
        return target.compute_limits(compose(np.clip(centre + deviation * scaled, lower, upper)))

    scaled = scipy.optimize.Bounds((lower - centre) / deviation, (upper - centre) / deviation)
    first = np.clip((start - centre) / deviation, scaled.lb, scaled.ub)
    fit = fit_limits(compute, target, 1.0, first, most=most, bounds=scaled, report=report)
    return replace(fit, values=np.clip(centre + deviation * fit.values, lower, upper))


def compute_prior(scaled: Values, prior: Prior) -> float:
    """Contribution to the score of a prior with these standard deviations around zero [-]."""
    return 0.5 * float(np.sum((scaled / prior) ** 2))


def compute_if_possible(compute: ComputeLimits, scaled: Values) -> FamilyLimits | None:
    """Limits at some parameters; None if there is no such model, or no steady state of it."""
    try:
        return compute(scaled)
    except (InputError, NoSteadyState):  # for example a damper that leaves its groove
        return None
