"""Measurements and the covariance that they are compared with a model by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from correlation.feature_vector import FeatureVector
from correlation.nuisance import Budget, budget_modes, curvature_modes, history_modes, jitter_modes
from correlation.observation import Observation
from correlation.prediction import Prediction, Predictor
from correlation.scatter import Scatter, scatter
from correlation.test_model import TestModel
from diagnosis.comparison import Comparison

#: Friction histories drawn for the covariance, and the seed that they are drawn with.
DRAWS, SEED = 6, 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """Measurements, how they are compared, and what predicts the same."""

    observed: Observation
    features: FeatureVector
    predictor: Predictor

    @classmethod
    def of(cls, observed: Observation, sweeps: tuple[int, ...]) -> "Measured":
        """Prepare measurements that were swept in some directions, see `correlation.observation.followed`."""
        features = FeatureVector.of(observed.points, observed.value, observed.motion)
        return cls(observed=observed, features=features, predictor=Predictor(points=observed.points, sweeps=sweeps))


def weighed(
    of: Measured, model: TestModel, prediction: Prediction, budget: Budget, refined: Sequence[TestModel]
) -> tuple[Comparison, Scatter]:
    """The comparison with noise, jitter, friction histories and numerical error in its covariance, and the jitter.

    Parameters
    ----------
    of
        Measurements.
    model, prediction
        Where modes are taken.
    budget
        Numerical error.
    refined
        Finer models with the parameters of `model`.
    """
    repeats = jitter_modes(of.predictor, of.features, model, prediction)
    history = history_modes(of.predictor, of.features, model, prediction, DRAWS, SEED)
    errors = budget_modes(of.predictor, of.features, model, prediction, budget, refined)
    seen = scatter(of.observed, of.features, repeats, history, errors)
    jitter = {name: float(np.sqrt(each[0, 0])) for name, each in zip(("jointed", "free"), seen.jitter, strict=False)}
    bent = curvature_modes(of.predictor, of.features, model, prediction, jitter)
    seen = seen._replace(whitening=seen.whitening.with_modes(bent))
    comparison = Comparison(
        observed=of.observed,
        features=of.features,
        measured=of.features.of_repeats(of.observed.repeat, of.observed.taken),
        whitening=seen.whitening,
        predictor=of.predictor,
    )
    return comparison, seen
