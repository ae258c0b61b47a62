"""Errors of planned readings: noise, jitter between repeats, friction histories, numerical error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.feature.vector import FeatureVector
from correlation.model import Model
from correlation.noise.covariance import Whitening
from correlation.noise.nuisance import (
    Budget,
    ModelFeatures,
    find_highest_frequency,
    make_error_tangents,
    make_history_modes,
)
from correlation.noise.scatter import HISTORY_NOISE_SHARE, USUAL_JITTER
from correlation.prediction import Points, Prediction, Predictor
from diagnosis.candidate.effect import Effect
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.jitter import list_jitter
from diagnosis.fit.reading_slopes import differentiate_readings
from diagnosis.next_test.planned_noise import PlannedNoise

Changes = Complex[NDArray[np.complex128], "k q"]

#: Number of drawn friction histories, and their seed.
DRAWS, SEED = 4, 1


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedErrors:
    """Errors of k readings, as changes of their coefficients by one standard deviation.

    Parameters
    ----------
    noise
        Noise of each part of a single reading, shape (k,).
    jitter, history
        Jitter, and friction histories, of one repeat.
    systematic
        Errors common to all repeats.
    """

    noise: Float[NDArray[np.float64], " k"]
    jitter: Changes
    history: Changes
    systematic: Changes

    def make_whitening(
        self, features: FeatureVector, value: Complex[NDArray[np.complex128], " n"], rows: Int[NDArray[np.int64], " n"],
        n_repeat: int, n_sweep: int = 1,
    ) -> Whitening:  # fmt: skip
        """Covariance of features of some of the readings.

        Parameters
        ----------
        features
            Features of the readings.
        value
            Coefficients of the readings, shape (n,).
        rows
            Indices of the readings, shape (n,).
        n_repeat, n_sweep
            Number of repeats, and of sweeps of each [-].
        """

        def change(by: Changes) -> Float[NDArray[np.float64], "m q"]:
            return np.asarray(np.nan_to_num(features.slopes(value, by[rows])))

        history = change(self.history)
        reading = features.per_reading(value) * self.noise[rows][features.row] / np.sqrt(n_sweep)
        deviation = np.sqrt(reading**2 + HISTORY_NOISE_SHARE**2 * (history**2).sum(axis=1)) / np.sqrt(n_repeat)
        # Readings without a steady state are not compared.
        deviation = np.where(np.isfinite(deviation) & (deviation > 0), deviation, 1.0)
        modes = [change(self.jitter) / np.sqrt(n_repeat), history / np.sqrt(n_repeat), change(self.systematic)]
        return Whitening(deviation=deviation, modes=np.column_stack(modes))


def plan_errors(
    predictor: Predictor, model: Model, prediction: Prediction, jitter: Sequence[tuple[Effect, float]], budget: Budget,
    noise: PlannedNoise,
) -> PlannedErrors:  # fmt: skip
    """Errors of readings at the points of a predictor.

    Parameters
    ----------
    predictor, model, prediction
        Predictor of the points, model that is assumed to be true, and its prediction.
    jitter
        Jitter between repeats, with the standard deviation of one repeat.
    budget
        Numerical error of the model; the error of the mesh is left out, since models of one mesh are compared.
    noise
        Noise of the sensors.
    """
    points = predictor.points
    unknowns = Unknowns.from_effects(model, jitter, ())
    differs = differentiate_readings(predictor, unknowns, unknowns.vanishing, model, prediction) * unknowns.prior
    errors = make_error_tangents(model, prediction, budget, find_highest_frequency(points))
    systematic = predictor.derivatives(model, prediction, errors.tangents) * errors.size
    apart = [
        np.where((points.level == level)[:, None], systematic[:, errors.n_shared :], 0.0)
        for level in np.unique(points.level)
    ]
    plain = ModelFeatures(predictor, _take_coefficients(points), model, prediction).coarse()
    return PlannedErrors(
        noise=noise.deviation(points, prediction.value),
        jitter=differs,
        history=_to_changes(plain.features, make_history_modes(plain, DRAWS, SEED)),
        systematic=np.column_stack([systematic[:, : errors.n_shared], *apart]),
    )


def list_usual_jitter(model: Model) -> list[tuple[Effect, float]]:
    """Usual jitter between repeats, with standard deviations, if it is not measured."""
    sizes = [size**2 * np.eye(1) for size in USUAL_JITTER[:-1]]
    return list_jitter(model, [*sizes, USUAL_JITTER[-1] ** 2 * np.eye(len(model.preload_groups))])


def _take_coefficients(points: Points) -> FeatureVector:
    """Features that are the real and imaginary parts of the coefficients."""
    none = np.zeros(len(points), dtype=np.bool_)
    return FeatureVector(
        points=points, fundamental=none, inverse=none, reference=np.full(len(points), -1),
        real_only=points.harmonic == 0, amplitude=none,
    )  # fmt: skip


def _to_changes(features: FeatureVector, modes: Float[NDArray[np.float64], "m q"]) -> Changes:
    """Modes of such features as complex changes of the coefficients."""
    k = len(features.points)
    changes = modes[:k].astype(np.complex128)
    changes[~features.real_only] += 1j * modes[k:]
    return changes
