r"""Comparison of time records with a model: residuals, their blocks in time, and starts of ring-downs.

Each sensor is compared after subtraction of its mean, since amplifiers drift, and in units of its root mean square, so
that the mean squared residual is a squared relative error. The residual is coloured (mostly by model error), so that
the covariance of a fit is estimated from blocks of the records:

.. math:: \operatorname{cov} = H^{-1} \Big(\sum_b g_b g_b^T\Big) H^{-1}, \qquad H = J^T J, \quad g_b = J_b^T r_b

References
----------
Cameron and Miller, Journal of Human Resources 50 (2015) 317, eq 11.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.linalg import eigh

from correlation.errors import CampaignError
from correlation.model import Model
from correlation.time_record.prediction import IntegrationInput, Samples, predict_rates, predict_record
from diagnosis.fit.calibration import Matrix, Search, Vector, invert_curvature
from diagnosis.fit.fit_parameter import Unknowns, Values
from hbsolve.errors import ModelError

#: Blocks per record; their scatter gives that of their sum for any short correlation time of the residual.
BLOCKS = 20
#: Largest number of modes of the start of a ring-down.
MODES = 6
#: Step of the differences of matrices and joint parameters, relative to the size of each number.
STEP = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordPrediction:
    """Response of a model to the forces of records.

    Parameters
    ----------
    starts
        Starts of ring-downs, shape (n_start,).
    residual
        (measured - predicted) in units of each sensor, shape (m,).
    """

    starts: Values
    residual: Vector


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordComparison:
    """Records to compare a model with.

    Parameters
    ----------
    drives
        Records with their forces.
    basis
        Basis of the start of each record, shape (b, 2 r); empty for records with a force, which start at rest.
    noise
        Standard deviation of each sensor, by name [its unit]; 0 if unknown.
    """

    drives: tuple[IntegrationInput, ...]
    basis: tuple[Float[NDArray[np.float64], "b n"], ...]
    noise: dict[str, float]

    search: ClassVar[Search] = Search(steps=40, failures=7, gain=0.0, share=1e-7, updated=False)

    @classmethod
    def prepare(cls, drives: Sequence[IntegrationInput], model: Model, noise: dict[str, float]) -> "RecordComparison":
        """Records of a model; those without a force start in its lowest modes.

        Raises
        ------
        CampaignError
            A record with fewer samples than blocks, or a sensor with a constant reading.
        """
        for item in drives:
            if item.measured.shape[1] < BLOCKS:
                raise CampaignError(
                    f'record "{item.record.name}": {item.measured.shape[1]} samples after the run-in are too few, give '
                    f"{BLOCKS} or more"
                )
            for name, size in zip(item.sensors, _compute_size(item), strict=True):
                if not size > 0:
                    raise CampaignError(f'record "{item.record.name}": "{name}" never changes after the run-in')
        basis = [_make_starts(item, model) for item in drives]
        return cls(drives=tuple(drives), basis=tuple(basis), noise=dict(noise))

    @property
    def n_start(self) -> int:
        """Number of parameters of the starts of ring-downs [-]."""
        return sum(len(item) for item in self.basis)

    @property
    def block(self) -> Int[NDArray[np.int64], " m"]:
        """Block of each residual, shape (m,): sensors of a record share their blocks."""
        return np.concatenate(
            [
                BLOCKS * number + np.tile(np.arange(item.measured.shape[1]) * BLOCKS // item.measured.shape[1], s)
                for number, item in enumerate(self.drives)
                for s in (len(item.sensors),)
            ]
        )

    @property
    def floor(self) -> Float[NDArray[np.float64], " records"]:
        """Relative error of each record by noise, shape (n_record,) [-]."""
        ratios = [
            [self.noise.get(name, 0.0) / size for name, size in zip(item.sensors, _compute_size(item), strict=True)]
            for item in self.drives
        ]
        return np.array([np.sqrt(np.mean(np.square(item))) for item in ratios])

    def predict(self, model: Model, nearby: Any = None, starts: Values | None = None) -> RecordPrediction:
        """Response of the model with ring-downs from `starts`, or from rest.

        Raises
        ------
        ModelError
            The model diverges.
        """
        del nearby
        begin = np.zeros(self.n_start) if starts is None else starts
        result = []
        for item, start in zip(self.drives, self._split(begin), strict=True):
            prediction = predict_record(model, item, start)
            if prediction is None:
                raise ModelError(
                    f'the response of the model diverges in record "{item.record.name}": give other values'
                )
            result.append(_weight_values(item, item.measured - prediction))
        return RecordPrediction(starts=begin, residual=np.concatenate(result))

    def residual(self, prediction: RecordPrediction) -> Vector:
        """(measured - predicted) in units of each sensor, shape (m,)."""
        return prediction.residual

    def has_prediction(self, prediction: RecordPrediction) -> NDArray[np.bool_]:
        """All numbers: a model that diverges has no prediction at all."""
        return np.ones(len(prediction.residual), dtype=bool)

    def slopes(
        self, unknowns: Unknowns, values: Values, model: Model, prediction: RecordPrediction, first: int = 0
    ) -> Matrix:
        """Derivatives of the predictions with respect to starts of ring-downs and values, shape (m, p - first)."""
        n, pairs = unknowns.n_start, []
        for number, ((lower, upper), size) in enumerate(zip(unknowns.bounds, unknowns.size, strict=True)):
            if number < max(first, n):
                continue
            low, high = np.array(values), np.array(values)
            low[number] = np.clip(values[number] - STEP * size, lower, upper)
            high[number] = np.clip(values[number] + STEP * size, lower, upper)
            pairs.append((unknowns.compose(low), unknowns.compose(high), float(high[number] - low[number])))
        rows, done = [], 0
        for item, start, basis in zip(self.drives, self._split(prediction.starts), self.basis, strict=True):
            wanted = basis[:0] if first >= n else basis
            rates = predict_rates(model, item, pairs, start, wanted)
            weighted = np.array([_weight_values(item, rate) for rate in rates]).reshape(len(rates), item.measured.size)
            table = np.zeros((item.measured.size, n + len(pairs)))
            table[:, n:] = weighted[: len(pairs)].T
            table[:, done : done + len(wanted)] = weighted[len(pairs) :].T
            done += len(wanted)
            rows.append(table[:, min(first, n) :])
        return np.concatenate(rows)

    def covariance(self, residual: Vector, jacobian: Matrix, size: Values) -> Float[NDArray[np.float64], "p p"]:
        """Covariance from the scatter of blocks, since residuals are coloured; the rows of priors come last."""
        jacobian, residual, block = jacobian[: len(self.block)], residual[: len(self.block)], self.block
        scores = np.zeros((int(block.max()) + 1, jacobian.shape[1]))
        np.add.at(scores, block, jacobian * residual[:, None])
        inverse = invert_curvature(jacobian, size)
        few = len(scores) / (len(scores) - 1)
        return np.asarray(few * inverse @ (scores.T @ scores) @ inverse)

    def errors(self, residual: Vector) -> Float[NDArray[np.float64], " records"]:
        """Relative error of each record: root mean square of the residual over that of the measurement [-]."""
        parts = np.split(residual[: len(self.block)], np.cumsum([item.measured.size for item in self.drives])[:-1])
        return np.array([np.sqrt(np.mean(part**2)) for part in parts])

    def by_block(self, squares: Vector) -> Float[NDArray[np.float64], " blocks"]:
        """Mean of some squares in each block; every record has the same weight."""
        block = self.block
        return np.asarray(np.bincount(block, weights=squares[: len(block)]) / np.bincount(block))

    def _split(self, starts: Vector) -> list[Float[NDArray[np.float64], " n"]]:
        parts = np.split(starts, np.cumsum([len(item) for item in self.basis])[:-1])
        return [part @ basis for part, basis in zip(parts, self.basis, strict=True)]


def _compute_size(driven: IntegrationInput) -> Float[NDArray[np.float64], " s"]:
    return np.asarray(driven.measured.std(axis=1))


def _weight_values(driven: IntegrationInput, values: Samples) -> Vector:
    return np.asarray(((values - values.mean(axis=1, keepdims=True)) / _compute_size(driven)[:, None]).ravel())


def _make_starts(driven: IntegrationInput, model: Model) -> Float[NDArray[np.float64], "b n"]:
    """Displacements and velocities of the modes that the record can resolve."""
    system = model.system
    if driven.record.force is not None:
        return np.zeros((0, 2 * system.n_dof))
    squared, shapes = eigh(system.stiffness, system.mass)
    frequency = np.sqrt(np.abs(squared))
    seen = np.flatnonzero(frequency < np.pi / driven.record.step)[:MODES]
    still = np.zeros((len(seen), system.n_dof))
    position, speed = shapes[:, seen].T, (shapes[:, seen] * np.maximum(frequency[seen], 1e-9)).T
    return np.vstack([np.hstack([position, still]), np.hstack([still, speed])])
