r"""Intervals of calibrated parameters.

For parameters fitted to families, the score C of `diagnosis.fit.family_target` acts as the negative log-likelihood. At
the ends of the 95 % interval of a parameter the profile of C plus prior,

.. math:: P_i(t) = \min_{s,\ s_i = t} \left[C(s) + \sum_j \frac{s_j^2}{2 \sigma_j^2}\right],

s being the parameters in their steps and sigma the standard deviations of their prior, has risen by 1.92. The limits in
C are linearised about the calibrated parameters, by central differences of 0.3 steps, and extrapolated over the whole
interval. A parameter that the families do not determine has the interval of its prior. A few friction histories reach
only a part of the limits, and other histories reach another part: the scatter of the minimum of C over draws of the
histories is independent of the measurements and adds in quadrature. Density and damping ratio follow from the
resonances of the lowest level, so that their intervals are those of least squares. The effect of errors of the model's
frequencies on k_t and on the density (`study.paper.frequency_error`) adds in quadrature too.

References
----------
D. A. Sprott, Statistical Inference in Science (2000), on profile likelihood.
"""

import itertools
import operator
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import hypot, inf
from typing import Any

import numpy as np
import scipy.optimize
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.uncertainty.interval import TWO_SIDED_95, compute_student_factor
from diagnosis.fit.family_fit import (
    MOST_RADIUS,
    MOST_SLOPE,
    LinearLimits,
    MapOver,
    compute_if_possible,
    compute_prior,
    minimise_linear,
)
from diagnosis.fit.family_target import FamilyLimits, FamilyTarget
from pipeline.store import stage
from study.estimate.resonance import MeasuredResonance
from study.paper.fit import LimitComputation, ParameterFit
from study.paper.model import ModelInputs, PaperModel
from study.paper.parameters import POSITIVE

Values = Float[NDArray[np.float64], " p"]

#: Rise of the profile at the ends of a 95 % interval.
RISE = TWO_SIDED_95**2 / 2
#: Largest change of the other parameters when one moves by `MOVE`, and tolerance of an interval end [steps].
FOLLOW, MOVE, NEAR = 2.0, 1.0, 0.02
#: Further draws of the friction histories: the standard deviation of seven values has a relative error of 0.3.
N_DRAW = 6
#: Factor on that deviation, by Student's distribution.
STUDENT_FACTOR = compute_student_factor(N_DRAW)
PROFILE, LEAST_SQUARES, FREQUENCIES = "profile of the criterion", "least squares", "frequencies of the model"
HISTORIES = "drawn histories"


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A 95 % interval.

    Parameters
    ----------
    name
        Parameter.
    value, lower, upper
        Calibrated value and both ends [unit of the parameter].
    source
        Data that determine it.
    """

    name: str
    value: float
    lower: float
    upper: float
    source: str

    def holds(self, value: float) -> bool:
        """Whether the interval contains a value."""
        return self.lower <= value <= self.upper

    def widen(self, deviation: float, source: str, least: float = -inf) -> "Interval":
        """The interval with an independent error, added in quadrature.

        Parameters
        ----------
        deviation
            Standard deviation of the error [unit of the parameter].
        source
            Source of the error.
        least
            Least value of the parameter [its unit].
        """
        more = TWO_SIDED_95 * deviation
        return replace(
            self, lower=max(self.value - hypot(self.value - self.lower, more), least),
            upper=self.value + hypot(self.upper - self.value, more), source=f"{self.source}, {source}",
        )  # fmt: skip


@stage("intervals of the rig's parameters", ignore=("make", "report", "map_over"))
def find_intervals(
    inputs: ModelInputs,  # noqa: ARG001 - what is stored depends on it, and `make` cannot be looked into
    fit: ParameterFit,
    target: FamilyTarget,
    make: PaperModel,
    report: Callable[[float, float], None] | None = None,
    map_over: MapOver = map,
) -> tuple[Interval, ...]:
    """Intervals of the parameters of a fit by the profiles of its score.

    Parameters
    ----------
    inputs
        What the models depend on.
    fit
        Fit.
    target
        Families of the fit.
    make
        Makes the model of some parameters.
    report
        Progress.
    map_over
        `map`, or one over processes.

    Raises
    ------
    InputError, NoSteadyState
        The calibrated model has no steady state.
    """
    scale, n_done, most = fit.scale, 0, 3 * len(fit.scale.tuned) + 1 + N_DRAW

    def advance() -> None:
        nonlocal n_done
        n_done += 1
        if report is not None:
            report(min(n_done, most), most)

    def count(items: Iterable[Any]) -> Iterator[Any]:
        for item in items:
            advance()
            yield item

    def compute_each(moved: Iterable[Values]) -> Iterator[FamilyLimits | None]:
        return count(map_over(partial(compute_if_possible, compute), moved))

    at = scale.to_steps(fit.parameters)
    compute = LimitComputation(make=make, scale=scale, target=target)
    draws = [replace(compute, target=replace(target, seed=target.seed + number)) for number in range(N_DRAW + 1)]
    here, *drawn = count(map_over(operator.call, draws, itertools.repeat(at)))
    profile = Profile(LinearLimits.differentiate(target, compute_each, at, here, MOST_SLOPE), scale.prior)
    deviation = profile.find_deviation(drawn)
    result = []
    for number, (name, tuning) in enumerate(scale.tuned.items()):
        interval = _read_interval(fit, name, *profile.find_ends(number))
        least = 0.0 if name in POSITIVE else -inf
        result.append(interval.widen(STUDENT_FACTOR * tuning.step * deviation[number], HISTORIES, least))
        advance()
    return tuple(result)


def _read_interval(fit: ParameterFit, name: str, low: float, high: float) -> Interval:
    start, step = getattr(fit.scale.start, name), fit.scale.tuned[name].step
    value = getattr(fit.parameters, name)
    return Interval(
        name=name, value=value, lower=min(start + step * low, value), upper=max(start + step * high, value),
        source=PROFILE,
    )  # fmt: skip


class Profile:
    """Profiles of the score of linearised limits plus the prior, from their minimum; ends in steps from the start."""

    def __init__(self, linear: LinearLimits, prior: Values) -> None:
        self._linear, self._prior = linear, prior
        self._best = self._find_least(linear)
        self._least = self._score(linear, self._best)

    def _find_least(self, linear: LinearLimits) -> Values:
        # A search may end at a kink of the score: start it from around the calibrated parameters as well.
        moves = MOVE * np.eye(len(linear.at))
        starts = [linear.at, *(linear.at + moves), *(linear.at - moves)]
        ends = (minimise_linear(linear, self._prior, start, MOST_RADIUS) for start in starts)
        return min(ends, key=lambda scaled: self._score(linear, scaled))

    def _score(self, linear: LinearLimits, scaled: Values) -> float:
        return linear.score(scaled) + compute_prior(scaled, self._prior)

    def find_deviation(self, limits: Sequence[FamilyLimits]) -> Values:
        """Standard deviation of the minimising parameters over these and other limits, shape (p,) [steps].

        Parameters
        ----------
        limits
            Other limits at the same parameters.
        """
        others = [self._find_least(self._linear.with_limits(item)) for item in limits]
        return np.asarray(np.std([self._best, *others], axis=0, ddof=1))

    def find_ends(self, number: int) -> tuple[float, float]:
        """Lower and upper end of the 95 % interval of a parameter, given by its number [steps]."""
        low, high = (self._find_end(number, sign) for sign in (-1.0, 1.0))
        return low, high

    def _find_end(self, number: int, sign: float) -> float:
        """Bracket the end by steps outwards, which the prior makes finite, and solve between the last two."""
        inner = self._best
        while self._rise(outer := self._follow(inner, number, inner[number] + sign * MOVE)) < RISE:
            inner = outer
        return float(
            scipy.optimize.brentq(
                lambda value: self._rise(self._follow(inner, number, value)) - RISE, inner[number], outer[number],
                xtol=NEAR,
            )
        )  # fmt: skip

    def _rise(self, scaled: Values) -> float:
        return self._score(self._linear, scaled) - self._least

    def _follow(self, scaled: Values, number: int, value: float) -> Values:
        """Minimise over the other parameters with one parameter fixed."""
        start = scaled.copy()
        start[number] = value
        fixed = np.full(len(start), np.inf)
        lower, upper = -fixed, fixed.copy()
        lower[number] = upper[number] = value
        return minimise_linear(self._linear, self._prior, start, FOLLOW, scipy.optimize.Bounds(lower, upper))


def find_damping_interval(damping: float, stuck: MeasuredResonance) -> Interval:
    """Interval of the damping ratio, from the width of the measured resonance at the lowest level (all stuck)."""
    half = TWO_SIDED_95 * stuck.damping_deviation
    return Interval(
        name="damping", value=damping, lower=damping - half, upper=damping + half, source=LEAST_SQUARES
    )  # fmt: skip


def find_density_interval(density: float, free: MeasuredResonance) -> Interval:
    """Interval of the density, from the measured free resonance: the density of the blade scales all frequencies."""
    half = 2 * TWO_SIDED_95 * free.frequency_deviation / free.frequency * density
    return Interval(
        name="density", value=density, lower=density - half, upper=density + half, source=LEAST_SQUARES
    )  # fmt: skip
