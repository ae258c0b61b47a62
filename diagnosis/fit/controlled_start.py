"""Starts of fits far from the truth, from fits under response control."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from correlation.noise.error_size import ErrorSize
from diagnosis.candidate.effect import Effect
from diagnosis.fit.calibration import Ending, Fit, calibrate
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.controlled_comparison import ControlledComparison
from diagnosis.fit.fit_parameter import Unknowns, Values
from diagnosis.fit.problem import EffectSelection, Screened
from diagnosis.screening import compute_slope_gains
from hbsolve.errors import ModelError

#: Usual error of the readings of a model for which none is stated [-].
USUAL_MODEL_ERROR = 1e-3
#: Fits, each with deviations that the misfit of the one before asks for.
ROUNDS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlledFit:
    """A fit under response control.

    Parameters
    ----------
    comparison
        Measurements, with deviations so large that chi^2 is as expected.
    fit
        The fit.
    error_factor
        Factor on the deviations of noise and usual model error [-].
    """

    comparison: ControlledComparison
    fit: Fit
    error_factor: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _Controlled:
    """A problem under response control."""

    of: Screened
    train: ControlledComparison
    fit: Fit

    @property
    def selection(self) -> EffectSelection:
        return self.of.selection

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        return self.of.unknowns(effects)


def fit_under_control(comparison: Comparison, unknowns: Unknowns, start: Values, usual: float) -> ControlledFit:
    """Fit at measured motions.

    Parameters
    ----------
    comparison
        Measurements under the given force.
    unknowns, start
        Parameters, and where the fit begins.
    usual
        Usual error of readings [-]; zero for what is usual elsewhere.
    """
    size, values, error_factor, fit = ErrorSize.usual(usual or USUAL_MODEL_ERROR), unknowns.clipped(start), 1.0, None
    weighed = ControlledComparison.from_comparison(comparison, unknowns.compose(values), size)
    for number in range(ROUNDS):
        model = unknowns.compose(values)
        plain = ControlledComparison.from_comparison(comparison, model, size) if number else weighed
        if fit is None:
            # A large error first, so that priors count.
            error_factor = max(1.0, _root_mean_square(plain.residual(plain.predict(model))))
        weighed, before = plain.scaled(error_factor), weighed
        # The predictions are the same: their deviations are others.
        ratio = (before.deviation / weighed.deviation)[:, None]
        slopes = None if fit is None else fit.reweigh(partial(np.multiply, ratio))
        fit = calibrate(weighed, unknowns, values, slopes=slopes, ending=Ending.QUICK)
        values = fit.values
        error_factor *= _root_mean_square(fit.residual[: fit.n_number])
        error_factor = max(error_factor, 1.0)
    assert fit is not None
    return ControlledFit(comparison=weighed, fit=fit, error_factor=error_factor)


def find_controlled_starts(
    problem: Screened, comparison: Comparison, effects: Sequence[Effect], usual: float
) -> list[tuple[Effect, Values]]:
    """Effects that explain most at measured motions, best first, and the values of their fits.

    Parameters
    ----------
    problem
        Parameters of the fits, and how many effects deserve one.
    comparison
        Measurements under the given force.
    effects
        Candidates.
    usual
        As in `fit_under_control`.
    """
    unknowns = problem.unknowns([])
    without = fit_under_control(comparison, unknowns, unknowns.vanishing, usual)
    weighed = without.comparison
    exact = calibrate(weighed, unknowns, without.fit.values, without.fit.prediction, ending=Ending.EXACT)
    gains = compute_slope_gains(_Controlled(of=problem, train=weighed, fit=exact), effects)
    result = []
    for number in np.argsort(-gains)[: problem.selection.n_shortlisted]:
        effect = effects[number]
        more = problem.unknowns([effect])
        start = np.array([*exact.values, *more.vanishing[len(exact.values) :]])
        try:
            result.append((effect, fit_under_control(comparison, more, start, usual)))
        except ModelError:
            continue  # a structure with so much of it is not supported
    return [(effect, item.fit.values) for effect, item in sorted(result, key=lambda pair: pair[1].error_factor)]


def _root_mean_square(residual: Values) -> float:
    return float(np.sqrt(np.mean(residual**2))) if len(residual) else 0.0
