"""Changes of all features by the errors of a model."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from correlation.feature.vector import FeatureVector
from correlation.model import Model
from correlation.model_solver import Tangent
from correlation.noise.covariance import Whitening
from correlation.noise.error_size import ErrorSize
from correlation.noise.nuisance import NOTHING, ModelFeatures, Modes, make_frequency_shifts, split_by_level
from correlation.prediction import Prediction, Predictor
from hbsolve.model_rates import MatrixParameter, ModelParameter

Vector = Float[NDArray[np.float64], " m"]

#: Number of parts of a curve with independent errors.
PARTS_PER_CURVE = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorPatterns:
    """Changes of all features by 100 % of the errors of a model.

    Parameters
    ----------
    frequency, damping
        F and D, shapes (m, a) and (m, b).
    reading
        g, shape (m,).
    part
        Number of the column of G of each feature, shape (m,).
    shape
        H, shape (m, d).
    """

    frequency: Modes
    damping: Modes
    reading: Vector
    part: Int[NDArray[np.int64], " m"]
    shape: Modes

    @classmethod
    def at(
        cls, features: FeatureVector, predictor: Predictor, model: Model, prediction: Prediction, measured: Vector
    ) -> "ErrorPatterns":
        """Patterns at a model and its prediction.

        Parameters
        ----------
        features, predictor
            Features of the measurements, and a predictor of the same points.
        model, prediction
            Model and its prediction.
        measured
            Features of the measurements, shape (m,); the errors of readings are relative to their moduli.
        """
        nominal = ModelFeatures(predictor.share(model), features, model, prediction)
        matrices = MatrixParameter(damping=model.system.damping, structural_damping=model.system.structural_damping)
        damped = ModelParameter(matrices=matrices)
        damping = [Tangent(jointed=damped, free=NOTHING, gain={}), Tangent(jointed=NOTHING, free=damped, gain={})]
        changes = nominal.slopes([*make_frequency_shifts(model, by_exciter=False), *damping])
        return cls(
            frequency=_split_changes_by_level(features, changes[:, :2]),
            damping=_split_changes_by_level(features, changes[:, 2:]),
            reading=compute_moduli(features, measured),
            part=_number_parts(features),
            shape=_make_shapes(features, prediction),
        )

    def modes(self, size: ErrorSize) -> Modes:
        """Columns of s_f F, s_d D and s_h H that are not zero, shape (m, c)."""
        more = np.column_stack([size.frequency * self.frequency, size.damping * self.damping, size.shape * self.shape])
        return np.asarray(more[:, more.any(axis=0)])

    def parts(self, size: ErrorSize) -> Any:
        """Columns of s_r G, sparse, shape (m, p); None without errors of readings."""
        from scipy.sparse import csr_array

        if not size.reading or not len(self.part):
            return None
        rows = np.arange(len(self.part))
        return csr_array((size.reading * self.reading, (rows, self.part)))

    def widen(self, whitening: Whitening, size: ErrorSize) -> Whitening:
        """Whitening whose covariance includes errors of a given size."""
        deviation = np.hypot(whitening.deviation, size.reading * self.reading)
        modes = self.modes(size) if whitening.modes is None else np.column_stack([whitening.modes, self.modes(size)])
        return Whitening(deviation=deviation, modes=modes, parts=self.parts(size))


def _split_changes_by_level(features: FeatureVector, changes: Modes) -> Modes:
    """Changes as one column per level; zero columns are left out."""
    columns = np.column_stack([split_by_level(features, change) for change in changes.T])
    return np.asarray(columns[:, columns.any(axis=0)])


def compute_moduli(features: FeatureVector, measured: Vector) -> Vector:
    """Modulus of the complex number to which each feature belongs, shape (m,)."""
    squares = np.bincount(features.row, np.nan_to_num(measured) ** 2, minlength=len(features.points))
    return np.asarray(np.sqrt(squares)[features.row])


def _number_parts(features: FeatureVector) -> Int[NDArray[np.int64], " m"]:
    """Number of the quarter of a curve of each feature, separate for real and imaginary parts, shape (m,)."""
    points, row = features.points, features.row
    sensor = np.unique(points.sensor, return_inverse=True)[1]
    imaginary = np.arange(len(row)) >= len(points)
    curve = np.column_stack([sensor, points.harmonic, points.free, points.level, points.sweep])[row]
    number = np.unique(np.column_stack([curve, imaginary]), axis=0, return_inverse=True)[1].ravel()
    part = np.zeros(len(row), dtype=np.int64)
    for item in np.unique(number):
        own = np.flatnonzero(number == item)
        rank = np.argsort(np.argsort(points.frequency[row[own]], kind="stable"), kind="stable")
        part[own] = PARTS_PER_CURVE * item + PARTS_PER_CURVE * rank // len(own)
    return np.asarray(np.unique(part, return_inverse=True)[1]).ravel()


def _make_shapes(features: FeatureVector, prediction: Prediction) -> Modes:
    """Changes of a sensor's responses by 100 %, at all frequencies and on each quarter, in phase and in quadrature.

    Only fundamentals change: other harmonics are caused by joints and depend on the level in another way.
    """
    points, value = features.points, prediction.value
    sensor = np.unique(points.sensor, return_inverse=True)[1]
    curves = np.unique(np.column_stack([sensor, points.free]), axis=0, return_inverse=True)[1].ravel()
    columns = []
    for curve in np.unique(curves[points.harmonic == 1]):
        of_curve = (curves == curve) & (points.harmonic == 1)
        frequency = np.where(of_curve, points.frequency, np.nan)
        edges = np.nanquantile(frequency, np.arange(1, PARTS_PER_CURVE) / PARTS_PER_CURVE)
        part = np.searchsorted(edges, frequency)
        own = np.where(of_curve, value, 0.0)
        columns += [own, *(np.where(part == number, own, 0.0) for number in range(PARTS_PER_CURVE))]
    changes = np.array([turn * column for column in columns for turn in (1.0, 1j)]).reshape(-1, len(value)).T
    modes = np.nan_to_num(features.slopes(value, np.nan_to_num(changes)))
    return np.asarray(modes[:, np.abs(modes).max(axis=0, initial=0.0) > 0])
