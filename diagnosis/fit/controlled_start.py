"""Start values for fits far from the true parameters, from fits under response control."""

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

#: Usual error of the readings of a model without a stated one [-].
USUAL_MODEL_ERROR = 1e-3
#: Number of fits; each scales its standard deviations by the misfit of the previous one.
ROUNDS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlledFit:
    """A fit under response control.

    Parameters
    ----------
    comparison
        Measurements, with standard deviations scaled so that chi^2 has its expected value.
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
        Parameters, and their start values.
    usual
        Usual error of readings [-]; zero for `USUAL_MODEL_ERROR`.
    """
    size, values, error_factor, fit = ErrorSize.usual(usual or USUAL_MODEL_ERROR), unknowns.clipped(start), 1.0, None
    weighed = ControlledComparison.from_comparison(comparison, unknowns.compose(values), size)
    for number in range(ROUNDS):
        model = unknowns.compose(values)
        plain = ControlledComparison.from_comparison(comparison, model, size) if number else weighed
        if fit is None:
            # Start with a large error, so that the priors have weight.
            error_factor = max(1.0, _compute_rms(plain.residual(plain.predict(model))))
        weighed, before = plain.scaled(error_factor), weighed
        # The predictions are the same; only their standard deviations differ.
        ratio = (before.deviation / weighed.deviation)[:, None]
        slopes = None if fit is None else fit.reweigh(partial(np.multiply, ratio))
        fit = calibrate(weighed, unknowns, values, slopes=slopes, ending=Ending.QUICK)
        values = fit.values
        error_factor *= _compute_rms(fit.residual[: fit.n_number])
        error_factor = max(error_factor, 1.0)
    assert fit is not None
    return ControlledFit(comparison=weighed, fit=fit, error_factor=error_factor)


def find_controlled_starts(
    problem: Screened, comparison: Comparison, effects: Sequence[Effect], usual: float
) -> list[tuple[Effect, Values]]:
    """Effects that explain most under response control, best first, and their fitted values.

    Parameters
    ----------
    problem
        Parameters of the fits, and number of effects to fit.
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
            continue  # with this strength the structure is not supported
    return [(effect, item.fit.values) for effect, item in sorted(result, key=lambda pair: pair[1].error_factor)]


def _compute_rms(residual: Values) -> float:
    return float(np.sqrt(np.mean(residual**2))) if len(residual) else 0.0
