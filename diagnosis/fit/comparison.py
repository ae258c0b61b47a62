"""Comparison of measured and predicted features, in standard deviations of noise and numerical error."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import NDArray

from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.jump_error import take_measured_branch
from correlation.model import Model
from correlation.noise.covariance import Whitening
from correlation.noise.model_error import ModelErrorCovariance
from correlation.prediction import Prediction, Predictor
from diagnosis.fit.calibration import Matrix, Search, Vector, invert_curvature
from diagnosis.fit.fit_parameter import Unknowns, Values
from diagnosis.fit.reading_slopes import differentiate_readings

#: Factor on the standard deviations of numbers that a calibration excludes.
EXCLUDED_FACTOR = 1e3
#: Residual of a number without a prediction: it penalises such a model [standard deviations].
NOT_FOUND = 10.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Observed features, their covariance, and the predictor of the same features.

    Parameters
    ----------
    observed
        Measurements.
    features
        Features by which they are compared.
    measured
        Features of the measurements, shape (m,).
    whitening
        Covariance of the features.
    predictor
        Predictor of the same points.
    noise
        Standard deviation of each number in a single repeat by noise alone, shape (m,).
    model_error
        Model error in the covariance, if there is any.
    deviation_factor
        Factors on the standard deviations of outliers, shape (m,); None without outliers.
    """

    observed: Observation
    features: FeatureVector
    measured: Vector
    whitening: Whitening
    predictor: Predictor
    noise: Vector
    model_error: ModelErrorCovariance | None = None
    deviation_factor: Vector | None = None

    search: ClassVar[Search] = Search()

    def predict(self, model: Model, nearby: Prediction | None = None, starts: Values | None = None) -> Prediction:
        """Steady states of the model, which have no starts.

        Raises
        ------
        ModelError
            The structure is not supported.
        """
        del starts
        return self.predictor.predict(model, nearby)

    def residual(self, prediction: Prediction) -> Vector:
        """S^(-1/2) (measured - predicted), shape (m,) [standard deviations]."""
        return self.residual_of(prediction.value)

    def residual_of(self, value: Complex[NDArray[np.complex128], " k"]) -> Vector:
        """The same for any coefficients."""
        predicted = self.features.of_values(value)
        there = np.isfinite(predicted)
        residual = self.whitening(np.where(there, self.measured - predicted, 0.0))
        return np.where(there, residual, NOT_FOUND)

    def difference(self, prediction: Prediction) -> Vector:
        """Measured less predicted features, zero where there is no prediction, shape (m,)."""
        return np.nan_to_num(self.measured - self.features.of_values(prediction.value))

    def error(self, prediction: Prediction) -> float:
        """Relative error of the fundamentals of motion: root mean square over each curve, then over all curves [-].

        Without a phase, moduli are compared. Between a measured and a predicted jump the model is evaluated on the
        branch of the structure: the error of the jump is its frequency error.
        """
        value = take_measured_branch(self.observed, prediction, self.predictor.sweeps)
        measured = self.observed.value
        predicted = np.where(self.features.amplitude, np.abs(value), value)
        there = np.isfinite(value) & (self.shares > 0)
        relative = np.abs(predicted[there] / measured[there] - 1)
        return float(np.sqrt(self.shares[there] @ relative**2 / self.shares[there].sum())) if there.any() else np.nan

    @cached_property
    def shares(self) -> Float[NDArray[np.float64], " k"]:
        """Weight of the squared relative error of each row, shape (k,); nonzero for fundamentals of motion alone.

        A curve is one sensor at one level of one configuration. All curves have equal weight; the points of a curve are
        weighted by their squared modulus.
        """
        points, rows = self.features.points, np.flatnonzero(self.features.fundamental)
        sensor = np.unique(points.sensor, return_inverse=True)[1]
        key = np.column_stack([points.free, points.level, sensor])[rows]
        curve = np.unique(key, axis=0, return_inverse=True)[1].ravel()
        squares = np.nan_to_num(np.abs(self.observed.value[rows])) ** 2
        sums = np.bincount(curve, squares)
        result = np.zeros(len(points))
        result[rows] = squares / np.where(sums > 0, sums, np.inf)[curve] / max(len(sums), 1)
        return result

    @property
    def log_weight(self) -> float:
        """-2 ln of the density of the measurements and the model error, less chi^2 [-]."""
        prior = 0.0 if self.model_error is None else self.model_error.prior
        return self.whitening.log_determinant + prior

    def scale_deviations(self, factor: Vector | None) -> "Comparison":
        """The same with factors on the deviations of numbers, shape (m,), or without any."""
        if factor is None:
            return self
        deviation_factor = factor if self.deviation_factor is None else factor * self.deviation_factor
        if self.model_error is None:
            return replace(self, whitening=_scale(self.whitening, factor), deviation_factor=deviation_factor)
        error = replace(self.model_error, without=_scale(self.model_error.without, factor))
        return replace(self, whitening=error.whitening, model_error=error, deviation_factor=deviation_factor)

    def has_prediction(self, prediction: Prediction) -> Bool[NDArray[np.bool_], " m"]:
        """Mask of the numbers that have a prediction."""
        return np.isfinite(self.features.of_values(prediction.value))

    def slopes(
        self, unknowns: Unknowns, values: Values, model: Model, prediction: Prediction, first: int = 0
    ) -> Matrix:
        """S^(-1/2) d predicted / d values, from value number `first` on, shape (m, p - first)."""
        slopes = differentiate_readings(self.predictor, unknowns, values, model, prediction, first)
        features = self.features.slopes(prediction.value, slopes)
        return self.whitening(np.where(np.isfinite(features), features, 0.0))

    def covariance(self, residual: Vector, jacobian: Matrix, size: Values) -> Float[NDArray[np.float64], "p p"]:
        """Inverse of the curvature of chi^2, as residuals are in standard deviations."""
        del residual
        return invert_curvature(jacobian, size)


def _scale(whitening: Whitening, factor: Vector) -> Whitening:
    return replace(whitening, deviation=whitening.deviation * factor)
