"""Time records beside a model: residuals, their blocks in time, and where ring-downs start from.

Each sensor is compared about its mean, since amplifiers drift, and in units of its root mean square, so that a squared
residual, averaged, is a squared relative error.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.linalg import eigh

from correlation.errors import CampaignError
from correlation.model import Model
from correlation.record_prediction import Drive, Samples, predict_record, record_rates

Vector = Float[NDArray[np.float64], " m"]
Matrix = Float[NDArray[np.float64], "m p"]

#: Blocks that each record is cut into, so that a sum over blocks has a scatter of its own whatever the residual's
#: correlation in time.
BLOCKS = 20
#: Modes, at most, that a ring-down may start in.
MODES = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordComparison:
    """Records to compare with.

    Parameters
    ----------
    drives
        Each record with its force.
    basis
        Of each record: states that it may start in beside rest, shape (b, 2 r); none where a force drives.
    noise
        Standard deviation of each sensor, by name [its unit]; 0 if it is not known.
    """

    drives: tuple[Drive, ...]
    basis: tuple[Float[NDArray[np.float64], "b n"], ...]
    noise: dict[str, float]

    @classmethod
    def of(cls, drives: Sequence[Drive], model: Model, noise: dict[str, float]) -> "RecordComparison":
        """Records of a model; those without a force start in its lowest modes.

        Raises
        ------
        CampaignError
            A sensor that reads the same number all the time.
        """
        for each in drives:
            for name, size in zip(each.sensors, _size(each), strict=True):
                if not size > 0:
                    raise CampaignError(f'record "{each.record.name}": "{name}" never changes after the run-in')
        basis = [_starts(each, model) for each in drives]
        return cls(drives=tuple(drives), basis=tuple(basis), noise=dict(noise))

    @property
    def n_start(self) -> int:
        """Numbers that say where ring-downs start."""
        return sum(len(each) for each in self.basis)

    @property
    def block(self) -> Int[NDArray[np.int64], " m"]:
        """Block of each residual, shape (m,): sensors of a record share their blocks."""
        return np.concatenate(
            [
                BLOCKS * number + np.tile(np.arange(each.measured.shape[1]) * BLOCKS // each.measured.shape[1], s)
                for number, each in enumerate(self.drives)
                for s in (len(each.sensors),)
            ]
        )

    @property
    def floor(self) -> Float[NDArray[np.float64], " records"]:
        """Relative error of each record that is noise [-]."""
        ratios = [
            [self.noise.get(name, 0.0) / size for name, size in zip(each.sensors, _size(each), strict=True)]
            for each in self.drives
        ]
        return np.array([np.sqrt(np.mean(np.square(each))) for each in ratios])

    def residual(self, model: Model, starts: Vector) -> Vector | None:
        """(measured - predicted) in units of each sensor, shape (m,); none where the model runs away."""
        found = []
        for each, start in zip(self.drives, self._split(starts), strict=True):
            prediction = predict_record(model, each, start)
            if prediction is None:
                return None
            found.append(_weighted(each, each.measured - prediction))
        return np.concatenate(found)

    def slopes(self, model: Model, starts: Vector, pairs: Sequence[tuple[Model, Model, float]]) -> Matrix:
        """Rates of the predictions with parameters, then with where ring-downs start, shape (m, p + n_start)."""
        rows, first = [], len(pairs)
        for each, start, basis in zip(self.drives, self._split(starts), self.basis, strict=True):
            rates = record_rates(model, each, pairs, start, basis)
            table = np.zeros((each.measured.size, len(pairs) + self.n_start))
            weighted = np.array([_weighted(each, rate) for rate in rates]).reshape(len(rates), -1)
            table[:, : len(pairs)] = weighted[: len(pairs)].T
            table[:, first : first + len(basis)] = weighted[len(pairs) :].T
            first += len(basis)
            rows.append(table)
        return np.concatenate(rows)

    def errors(self, residual: Vector) -> Float[NDArray[np.float64], " records"]:
        """Relative error of each record: root mean square of what is left, over that of the measurement [-]."""
        parts = np.split(residual, np.cumsum([each.measured.size for each in self.drives])[:-1])
        return np.array([np.sqrt(np.mean(part**2)) for part in parts])

    def by_block(self, squares: Vector) -> Float[NDArray[np.float64], " blocks"]:
        """Mean of some squares in each block: every record weighs the same."""
        block = self.block
        return np.asarray(np.bincount(block, weights=squares) / np.bincount(block))

    def _split(self, starts: Vector) -> list[Float[NDArray[np.float64], " n"]]:
        parts = np.split(starts, np.cumsum([len(each) for each in self.basis])[:-1])
        return [part @ basis for part, basis in zip(parts, self.basis, strict=True)]


def _size(driven: Drive) -> Float[NDArray[np.float64], " s"]:
    return np.asarray(driven.measured.std(axis=1))


def _weighted(driven: Drive, values: Samples) -> Vector:
    return np.asarray(((values - values.mean(axis=1, keepdims=True)) / _size(driven)[:, None]).ravel())


def _starts(driven: Drive, model: Model) -> Float[NDArray[np.float64], "b n"]:
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
