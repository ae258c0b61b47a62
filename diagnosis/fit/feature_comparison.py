"""Fits to data other than steady states: loops, ring-downs and modes, each described by a few features."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.data_type.registry import DATA_TYPES, Datum, Features
from correlation.errors import CampaignError
from correlation.model import Model
from diagnosis.fit.calibration import Data, Ending, Fit, Matrix, Search, Vector, calibrate, invert_curvature
from diagnosis.fit.comparison import NOT_FOUND
from diagnosis.fit.fit_parameter import Unknowns, Values

#: Step of a difference of predictions, relative to the typical size of a parameter: large compared with the accuracy of
#: predictions (1e-5 for a backbone), and small enough that curvature is negligible.
STEP = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class FeatureComparison:
    """Comparison of a model with features of some data.

    Parameters
    ----------
    data
        Measured data.
    features
        Features of each datum.
    """

    data: tuple[Datum, ...]
    features: tuple[Features, ...]

    search: ClassVar[Search] = Search(steps=12)

    @classmethod
    def from_data(cls, data: Sequence[Datum]) -> "FeatureComparison":
        """Features of some data."""
        return cls(data=tuple(data), features=tuple(DATA_TYPES[datum.type].features(datum) for datum in data))

    @property
    def measured(self) -> Vector:
        """Values of all features, shape (m,)."""
        return np.concatenate([[], *(item.value for item in self.features)])

    @property
    def deviation(self) -> Vector:
        """Standard deviations of all features, shape (m,)."""
        return np.concatenate([[], *(item.deviation for item in self.features)])

    def predict(self, model: Model, nearby: Any = None, starts: Values | None = None) -> Vector:
        """Prediction of all features, shape (m,); NaN for features without a prediction.

        Parameters
        ----------
        model
            A model.
        nearby
            Prediction of a model that this one is a variation of; None for the first one.
        starts
            Unused: these data have no initial values.

        Raises
        ------
        CampaignError
            The first model lacks something that the data refer to.
        """
        del starts
        predicted = []
        for datum, features in zip(self.data, self.features, strict=True):
            try:
                predicted.append(DATA_TYPES[datum.type].predict(model, datum))
            except (CampaignError, np.linalg.LinAlgError):
                # A trial value may make a mode unobservable by a sensor, or a mass negative.
                if nearby is None:
                    raise
                predicted.append(np.full(len(features.value), np.nan))
        return np.concatenate([[], *predicted])

    def residual(self, prediction: Vector) -> Vector:
        """Measured less predicted in standard deviations, shape (m,)."""
        there = np.isfinite(prediction)
        return np.where(there, (self.measured - np.where(there, prediction, 0.0)) / self.deviation, NOT_FOUND)

    def has_prediction(self, prediction: Vector) -> Bool[NDArray[np.bool_], " m"]:
        """Mask of the features that have a prediction."""
        return np.isfinite(prediction)

    def slopes(self, unknowns: Unknowns, values: Values, model: Model, prediction: Vector, first: int = 0) -> Matrix:
        """Derivatives of the predictions in standard deviations, from value number `first` on, by differences."""
        del model
        slopes = np.zeros((len(prediction), len(values) - first))
        for number in range(first, len(values)):
            moved, step = unknowns.neighbour(values, number, STEP)
            change = self.predict(moved, prediction) - prediction
            slopes[:, number - first] = change / step / self.deviation
        return np.where(np.isfinite(slopes), slopes, 0.0)

    def covariance(self, residual: Vector, jacobian: Matrix, size: Values) -> Float[NDArray[np.float64], "p p"]:
        """Inverse of the curvature of chi^2, shape (p, p)."""
        del residual
        return invert_curvature(jacobian, size)


@dataclass(frozen=True, kw_only=True, eq=False)
class JoinedComparison:
    """Two comparisons that one model is fitted to; its prediction is a pair of both."""

    first: Data
    second: Data

    @property
    def search(self) -> Search:
        """Limits of fits: those of the first."""
        return self.first.search

    def predict(self, model: Model, nearby: Any = None, starts: Values | None = None) -> tuple[Any, Any]:
        """Predictions of both."""
        one, other = nearby or (None, None)
        return self.first.predict(model, one, starts), self.second.predict(model, other)

    def residual(self, prediction: tuple[Any, Any]) -> Vector:
        """Residuals of both, one below the other."""
        return np.concatenate([self.first.residual(prediction[0]), self.second.residual(prediction[1])])

    def has_prediction(self, prediction: tuple[Any, Any]) -> NDArray[np.bool_]:
        """Masks of both."""
        return np.concatenate([self.first.has_prediction(prediction[0]), self.second.has_prediction(prediction[1])])

    def slopes(
        self, unknowns: Unknowns, values: Values, model: Model, prediction: tuple[Any, Any], first: int = 0
    ) -> Matrix:
        """Derivatives of both."""
        return np.vstack(
            [
                self.first.slopes(unknowns, values, model, prediction[0], first),
                self.second.slopes(unknowns, values, model, prediction[1], first),
            ]
        )

    def covariance(self, residual: Vector, jacobian: Matrix, size: Values) -> Float[NDArray[np.float64], "p p"]:
        """Covariance as the first comparison defines it."""
        return self.first.covariance(residual, jacobian, size)


def fit_together(first: Data, fit: Fit, data: Sequence[Datum]) -> Fit:
    """Continue a fit to steady states with other data in addition.

    Parameters
    ----------
    first
        Steady states.
    fit
        Fit to these alone.
    data
        Other data; without any the fit is returned unchanged.

    Returns
    -------
    The fit to both, with the prediction of the steady states.
    """
    if not data:
        return fit
    second = FeatureComparison.from_data(data)
    joined = JoinedComparison(first=first, second=second)
    begin = fit.prediction, second.predict(fit.model)
    result = calibrate(joined, fit.unknowns, fit.values, begin, ending=Ending.EXACT)
    return replace(result, prediction=result.prediction[0])
