"""Covariance by which measurements are compared with a model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.outlier import weigh_outliers
from correlation.model import Model
from correlation.noise.covariance import Whitening
from correlation.noise.kink import REACH, Shift, make_kink_modes
from correlation.noise.nuisance import (
    Budget,
    ModelFeatures,
    Modes,
    make_budget_modes,
    make_curvature_modes,
    make_history_modes,
    make_jitter_modes,
)
from correlation.noise.scatter import Scatter, estimate_scatter
from correlation.prediction import Prediction, Predictor
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.jitter import list_preload_jitter

#: Friction histories drawn for the covariance, and the seed that they are drawn with.
DRAWS, SEED = 16, 1
#: Histories from which the jitter between repeats is estimated before all histories are drawn with it.
FEW = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """Measurements, their features, and a predictor of the same points."""

    observed: Observation
    features: FeatureVector
    predictor: Predictor

    @classmethod
    def prepare(cls, observed: Observation, sweeps: tuple[int, ...]) -> "Measured":
        """Prepare measurements that were swept in these directions, +1 up and -1 down."""
        features = FeatureVector.choose(observed.points, observed.value, observed.motion & observed.heard)
        return cls(observed=observed, features=features, predictor=Predictor(points=observed.points, sweeps=sweeps))


def weighted(
    measured: Measured,
    model: Model,
    prediction: Prediction,
    budget: Budget,
    refined: Sequence[Model],
    n_draw: int = DRAWS,
    *,
    fitted: bool = True,
) -> tuple[Comparison, Scatter]:
    """Comparison with noise, jitter, friction histories and numerical error in its covariance, and the jitter.

    Parameters
    ----------
    measured
        Measurements.
    model, prediction
        Model whose modes are taken, and its prediction.
    budget
        Numerical error.
    refined
        Finer models with the parameters of `model`.
    n_draw
        Number of friction histories.
    fitted
        Whether the model is calibrated, so that states far from their neighbours get less weight.
    """
    nominal = ModelFeatures(measured.predictor, measured.features, model, prediction)
    repeats = make_jitter_modes(nominal)
    errors = make_budget_modes(nominal, budget, refined)
    history = partial(make_history_modes, nominal)
    seen = estimate_scatter(measured.observed, measured.features, repeats, history(min(n_draw, FEW), SEED), errors)
    if n_draw > FEW:
        pressed = seen.jitter[2] if len(seen.jitter) > 2 else None
        seen = estimate_scatter(measured.observed, measured.features, repeats, history(n_draw, SEED, pressed), errors)
    jitter = {name: float(np.sqrt(each[0, 0])) for name, each in zip(("jointed", "free"), seen.jitter, strict=False)}
    bent = make_curvature_modes(nominal, jitter)
    shifts = _shifts(model, repeats, seen)
    n_repeat = float(np.median(measured.observed.count))
    kinks = make_kink_modes(nominal, shifts, seen.whitening.deviation, n_repeat)
    seen = seen._replace(whitening=seen.whitening.with_modes(np.column_stack([bent, kinks])))
    comparison = Comparison(
        observed=measured.observed,
        features=measured.features,
        measured=measured.features.of_repeats(measured.observed.repeat, measured.observed.taken),
        whitening=seen.whitening,
        predictor=measured.predictor,
        noise=seen.noise,
    )
    if fitted:
        comparison = _steadied(comparison, prediction)
    return comparison, seen._replace(whitening=comparison.whitening)


def _steadied(comparison: Comparison, prediction: Prediction) -> Comparison:
    """The comparison with less weight for outlying states."""
    factor = weigh_outliers(comparison.features, comparison.residual(prediction))
    whitening = Whitening(deviation=comparison.whitening.deviation * factor, modes=comparison.whitening.modes)
    return replace(comparison, whitening=whitening)


def _shifts(model: Model, repeats: Sequence[Modes], seen: Scatter) -> list[Shift]:
    """Shifts by `REACH` standard deviations: of the frequency of the jointed test, and the largest one of preloads."""
    found, size = [], REACH * float(np.sqrt(seen.jitter[0][0, 0]))
    if size:
        ends = (model.shifted("jointed", size), model.shifted("jointed", -size))
        found.append(Shift(models=ends, change=repeats[0][:, 0] * size))
    if len(seen.jitter) > 2 and (patterns := list_preload_jitter(model, seen.jitter[2])):
        effect, deviation = max(patterns, key=lambda each: each[1])
        size = REACH * deviation
        along = np.array([dict(effect.shares)[group[0]] for group in model.presses])
        found.append(
            Shift(models=(effect.apply(model, [size]), effect.apply(model, [-size])), change=repeats[2] @ along * size)
        )
    return found
