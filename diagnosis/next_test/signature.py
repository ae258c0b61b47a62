"""Signatures: predictions of each candidate for the tests of one set-up, and the errors of these readings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.feature.vector import FeatureVector
from correlation.model import Model, Sensor
from correlation.noise.covariance import Whitening
from correlation.noise.error_patterns import ErrorPatterns
from correlation.noise.error_size import NO_ERROR, ErrorSize
from correlation.noise.nuisance import Budget
from correlation.prediction import Points, Prediction, Predictor
from correlation.row_group import group_rows
from correlation.row_table import join_tables
from diagnosis.candidate.effect import Effect, EffectParameter
from diagnosis.fit.reading_slopes import differentiate_readings
from diagnosis.next_test.candidate_model import CandidateModel
from diagnosis.next_test.next_test import FURTHER, NextTest, SetUp, apply_set_up
from diagnosis.next_test.planned_errors import PlannedErrors, plan_errors
from diagnosis.next_test.planned_noise import PlannedNoise
from diagnosis.next_test.separation import compute_separation, whiten_difference

#: Root mean square of z^2 of a standard normal z: an error of second order [-].
BENT = np.sqrt(3.0)

Readings = Complex[NDArray[np.complex128], " k"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorSources:
    """Error sources of readings.

    Parameters
    ----------
    jitter
        Jitter between repeats, with the standard deviation of one repeat.
    budget
        Numerical error of the model.
    noise
        Noise of the sensors.
    model_error
        Model error.
    unphased
        Names of sensors that read amplitudes without a phase.
    quantity
        Quantity of a further sensor.
    """

    jitter: Sequence[tuple[Effect, float]]
    budget: Budget
    noise: PlannedNoise
    model_error: ErrorSize = NO_ERROR
    unphased: frozenset[str] = frozenset()
    quantity: str = "displacement"


@dataclass(frozen=True, kw_only=True, eq=False)
class SignatureCurve:
    """Predictions of n candidates for one sensor, level and harmonic of a test.

    Parameters
    ----------
    sensor, level, harmonic
        Reading.
    frequency
        Frequencies, shape (f,) [Hz].
    value
        Predicted coefficients, shape (n, f) [unit of the sensor].
    deviation
        Standard deviation of each part of the mean reading by noise, shape (f,) [unit of the sensor].
    """

    sensor: str
    level: float
    harmonic: int
    frequency: Float[NDArray[np.float64], " f"]
    value: Complex[NDArray[np.complex128], "n f"]
    deviation: Float[NDArray[np.float64], " f"]


@dataclass(frozen=True, kw_only=True)
class SetUpEffect:
    """Set-up of a test, with its further sensors, as an effect without parameters."""

    set_up: SetUp
    places: tuple[str, ...]
    quantity: str
    name: str = "set-up"
    kind: str = "set-up"
    physics: str = "The structure as it is tested."
    signature: str = "It acts on all readings of a test."
    parameters: tuple[EffectParameter, ...] = ()

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model in the test."""
        del values
        further = [
            Sensor(name=f"{FURTHER}{place}", row=model.places[place], quantity=self.quantity) for place in self.places
        ]
        return apply_set_up(self.set_up, replace(model, sensors=(*model.sensors, *further)))


@dataclass(frozen=True, kw_only=True, eq=False)
class SetUpSignatures:
    """Predictions of n candidates at the points of all tests of a set-up.

    Parameters
    ----------
    points
        Points without duplicates, k rows.
    predictor, model, prediction
        Predictor of the points; the most probable candidate with its prediction.
    values
        Predicted readings of each candidate, shape (k,).
    spreads
        Changes of the readings by one standard deviation of the parameters of each candidate, shape (k, p).
    errors
        Errors of the readings.
    sources
        Error sources.
    """

    points: Points
    predictor: Predictor
    model: Model
    prediction: Prediction
    values: list[Readings]
    spreads: list[Complex[NDArray[np.complex128], "k p"]]
    errors: PlannedErrors
    sources: ErrorSources

    @classmethod
    def predict(
        cls, candidates: Sequence[CandidateModel], tests: Sequence[NextTest], sources: ErrorSources
    ) -> "SetUpSignatures":
        """Predict the tests of one set-up.

        Raises
        ------
        ModelError
            A candidate is not a supported structure in this set-up.
        """
        (set_up,) = {test.set_up for test in tests}
        places = tuple(dict.fromkeys(test.place for test in tests if test.place is not None))
        tested = SetUpEffect(set_up=set_up, places=places, quantity=sources.quantity)
        every = join_tables([test.make_points() for test in tests])
        points = every.where(np.sort(group_rows(_list_columns(every)).first))
        predictor = Predictor(points=points, sweeps=set_up.sweeps)
        models, predictions, values, spreads = [], [], [], []
        for candidate in candidates:
            unknowns = replace(candidate.unknowns, effects=(*candidate.unknowns.effects, tested))
            model = tested.apply(candidate.model, [])
            prediction = predictor.predict(model)
            slopes = differentiate_readings(predictor, unknowns, candidate.fit_values, model, prediction)
            changes = [_predict_change(predictor, tested, item, prediction) for item in candidate.draws]
            more = np.array(changes).reshape(len(changes), len(points)).T / np.sqrt(max(len(changes), 1))
            if candidate.curvature_pair is not None:
                up, down = (_predict_change(predictor, tested, item, prediction) for item in candidate.curvature_pair)
                more = np.column_stack([more, BENT * (up + down) / 2])
            models.append(model)
            predictions.append(prediction)
            values.append(prediction.value)
            spreads.append(np.column_stack([slopes @ candidate.root, more]))
        errors = plan_errors(predictor, models[0], predictions[0], sources.jitter, sources.budget, sources.noise)
        return cls(
            points=points, predictor=predictor, model=models[0], prediction=predictions[0], values=values,
            spreads=spreads, errors=errors, sources=sources,
        )  # fmt: skip

    def separate(self, test: NextTest) -> Float[NDArray[np.float64], "n n"]:
        """d^2 of each pair of candidates by a test, shape (n, n) [-]."""
        return compute_separation(*self.list_features(test))

    def list_features(
        self, test: NextTest
    ) -> tuple[list[Float[NDArray[np.float64], " m"]], list[Float[NDArray[np.float64], "m p"]], Whitening]:
        """Predicted features of a test by each candidate, their spreads, and the covariance of their errors."""
        features, whitening = self.compare(test)
        return *self._list_features(test, features), whitening

    def _list_features(
        self, test: NextTest, features: FeatureVector
    ) -> tuple[list[Float[NDArray[np.float64], " m"]], list[Float[NDArray[np.float64], "m p"]]]:
        rows = self._find_rows(test)
        signatures = [features.of_values(value[rows]) for value in self.values]
        spreads = [
            features.slopes(value[rows], spread[rows]) for value, spread in zip(self.values, self.spreads, strict=True)
        ]
        return signatures, spreads

    def take_curve(self, test: NextTest) -> SignatureCurve:
        """The reading of a test with the largest share of d^2 of the two most probable candidates."""
        rows = self._find_rows(test)
        points = self.points.where(rows)
        noise = self.errors.noise[rows] / np.sqrt(test.n_repeat * max(len(test.sweeps), 1))
        features, whitening = self.compare(test)
        signatures, spreads = self._list_features(test, features)
        apart = whiten_difference((signatures[0], signatures[1]), (spreads[0], spreads[1]), whitening)
        groups = group_rows([points.sensor, points.level, points.harmonic]).number
        best = groups == int(np.argmax(np.bincount(groups[features.row], apart**2)))
        best_rows = np.flatnonzero(best)[np.argsort(points.frequency[best])]
        first = best_rows[0]
        return SignatureCurve(
            sensor=str(points.sensor[first]), level=float(points.level[first]), harmonic=int(points.harmonic[first]),
            frequency=points.frequency[best_rows],
            value=np.array([value[rows][best_rows] for value in self.values]), deviation=noise[best_rows],
        )  # fmt: skip

    def _find_rows(self, test: NextTest) -> Int[NDArray[np.int64], " n"]:
        number = {key: place for place, key in enumerate(_list_keys(self.points))}
        return np.array([number[key] for key in _list_keys(test.make_points())], dtype=np.int64)

    def compare(self, test: NextTest) -> tuple[FeatureVector, Whitening]:
        """Features of a test, and the covariance of their errors."""
        rows = self._find_rows(test)
        part = self.prediction.where(rows)
        points, value = part.points, part.value
        cells = {item.name for item in self.model.sensors if not isinstance(item, Sensor)}
        motion = ~np.isin(points.sensor, [*cells])
        phased = ~np.isin(points.sensor, [*self.sources.unphased])
        features = FeatureVector.choose(points, value, motion, phased)
        whitening = self.errors.make_whitening(features, value, rows, test.n_repeat, max(len(test.sweeps), 1))
        if self.sources.model_error == NO_ERROR:
            return features, whitening
        predictor = replace(self.predictor, points=points)
        patterns = ErrorPatterns.at(features, predictor, self.model, part, np.nan_to_num(features.of_values(value)))
        return features, patterns.widen(whitening, self.sources.model_error)


def _predict_change(predictor: Predictor, tested: SetUpEffect, model: Model, prediction: Prediction) -> Readings:
    """Change of the readings from a prediction to that of another model; zero if either has no state."""
    return np.nan_to_num(predictor.predict(tested.apply(model, [])).value - prediction.value)


def _list_columns(points: Points) -> list[NDArray[Any]]:
    return [points.free, points.level, points.frequency, points.sensor, points.harmonic]


def _list_keys(points: Points) -> list[tuple[Any, ...]]:
    return list(zip(*(column.tolist() for column in _list_columns(points)), strict=True))
