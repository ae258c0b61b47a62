"""Comparison of measured features with a model under response control (motion prescribed), and of ends of branches.

Far from the true parameters, chi^2 of responses under a given force has many minima, one for each wrong overlap of
predicted and measured peaks. Under response control it usually has a single one, which serves as a start of the fits of
responses.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.jump_error import find_measured_jumps, list_swept_rows
from correlation.model import Model
from correlation.noise.error_patterns import compute_moduli
from correlation.noise.error_size import ErrorSize
from correlation.response_control import ControlledPrediction, ControlledPredictor, Fold
from diagnosis.fit.calibration import Matrix, Search, Vector, invert_curvature
from diagnosis.fit.comparison import NOT_FOUND, Comparison
from diagnosis.fit.fit_parameter import Unknowns, Values

#: Step of a difference of predictions, relative to the typical size of a parameter.
STEP = 1e-3
#: Relative change of frequencies and of damping for the difference quotients of their errors [-].
SHIFT = 1e-5


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlledComparison:
    """Features at measured motions, with their standard deviations.

    Parameters
    ----------
    features
        Features by which motions are compared.
    measured
        Features of the measurements, shape (m,).
    deviation
        Standard deviation of each feature by noise and model error, then relative standard deviation of the force of
        each fold, shape (m + f,).
    predictor
        Predictor at the measured motions.
    """

    features: FeatureVector
    measured: Vector
    deviation: Vector
    predictor: ControlledPredictor

    search: ClassVar[Search] = Search()

    @classmethod
    def from_comparison(cls, comparison: Comparison, model: Model, size: ErrorSize) -> "ControlledComparison":
        """The same measurements under response control.

        Parameters
        ----------
        comparison
            Measurements under the given force, with the noise of a single repeat.
        model, size
            Model, and the size of its errors.
        """
        of, features = comparison, comparison.features
        folds = list(_list_folds(of.observed, of.predictor.sweeps, size.reading))
        predictor = ControlledPredictor(
            points=features.points, measured=features.values(of.measured), motion=features.fundamental,
            folds=tuple(fold for fold, _ in folds),
        )  # fmt: skip
        nominal = features.of_values(predictor.predict(model).value)
        noise = of.noise / np.sqrt(np.maximum(of.observed.count[features.row], 1))
        variance = noise**2 + (size.reading * compute_moduli(features, of.measured)) ** 2
        for item, moved in (
            (size.frequency, model.with_frequency_shift("jointed", SHIFT).with_frequency_shift("free", SHIFT)),
            (size.damping, _scale_damping(model, 1 + SHIFT)),
        ):
            change = features.of_values(predictor.predict(moved).value) - nominal
            variance += np.nan_to_num(item / SHIFT * change) ** 2
        deviation = np.concatenate([np.sqrt(variance), [item for _, item in folds]])
        return cls(features=features, measured=of.measured, deviation=deviation, predictor=predictor)

    def scaled(self, factor: float) -> "ControlledComparison":
        """The same with all standard deviations multiplied by a factor."""
        return replace(self, deviation=factor * self.deviation)

    def predict(
        self, model: Model, nearby: ControlledPrediction | None = None, starts: Values | None = None
    ) -> ControlledPrediction:
        """States of the model at the measured motions; `starts` is unused."""
        del starts
        return self.predictor.predict(model, nearby)

    def residual(self, prediction: ControlledPrediction) -> Vector:
        """Measured less predicted, shape (m + f,) [standard deviations]."""
        difference = np.concatenate([self.measured - self._predicted(prediction), -np.log(prediction.fold)])
        there = np.concatenate([np.isfinite(self.measured), np.ones(len(prediction.fold), dtype=bool)])
        residual = np.where(np.isfinite(difference), difference / self.deviation, NOT_FOUND)
        return np.where(there, residual, 0.0)

    def has_prediction(self, prediction: ControlledPrediction) -> Bool[NDArray[np.bool_], " n"]:
        """Mask of the numbers that have a prediction, shape (m + f,)."""
        return np.asarray(np.isfinite(np.concatenate([self._predicted(prediction), prediction.fold])))

    def slopes(
        self, unknowns: Unknowns, values: Values, model: Model, prediction: ControlledPrediction, first: int = 0
    ) -> Matrix:
        """Derivatives of the predictions by differences, shape (m + f, p - first)."""
        del model
        here, columns = self.residual(prediction), np.zeros((len(self.deviation), len(values) - first))
        for number in range(first, len(values)):
            moved, step = unknowns.neighbour(values, number, STEP)
            there = self.predict(moved, prediction)
            both = self.has_prediction(there) & self.has_prediction(prediction)
            change = (here - self.residual(there)) / step
            columns[:, number - first] = np.where(both, change, 0.0)
        return columns

    def covariance(self, residual: Vector, jacobian: Matrix, size: Values) -> Float[NDArray[np.float64], "p p"]:
        """Inverse of the curvature of chi^2."""
        del residual
        return invert_curvature(jacobian, size)

    def _predicted(self, prediction: ControlledPrediction) -> Vector:
        return self.features.of_values(prediction.value)


def _list_folds(observed: Observation, sweeps: tuple[int, ...], error: float) -> Iterator[tuple[Fold, float]]:
    """Measured ends of branches, each with the relative standard deviation of its force."""
    points, size = observed.points, np.abs(observed.value)
    for jump, width in find_measured_jumps(observed, sweeps):
        rows, above = list_swept_rows(observed, jump)
        if not 2 <= above <= len(rows) - 2:
            continue
        left, reached = (rows[above - 1], rows[above])[:: jump.sweep]
        beside = rows[above - 2] if jump.sweep > 0 else rows[above + 1]
        # On the branch that ends, the force of a fold grows with frequency at least as fast as the amplitude.
        slope = 1 + abs(np.log(size[left] / size[beside]) / np.log(points.frequency[left] / points.frequency[beside]))
        deviation = float(np.hypot(slope * width / np.sqrt(12) / jump.frequency, error))
        lower, upper = sorted((float(size[left]), float(size[reached])))
        force = float(points.force[left])
        yield Fold(jump.free, str(points.sensor[left]), jump.frequency, force, lower, upper, jump.falls), deviation


def _scale_damping(model: Model, factor: float) -> Model:
    """Model with all damping multiplied by a factor."""
    loss = model.system.structural_damping
    return model.with_system(
        damping=factor * model.system.damping, structural_damping=None if loss is None else factor * loss
    )
