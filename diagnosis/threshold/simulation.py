"""Campaigns drawn from a fitted model: the same tests once more, with all that chance does to them.

Each repeat has its own frequency shift and preloads, each level in it its own friction history, each reading its own
noise; the model's numerical error is the same in all repeats. Histories are followed through stick and slip as a
measurement would be, since what they do to a single state is far from normally distributed.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import find_points
from correlation.feature.vector import FeatureVector
from correlation.model import Model
from correlation.noise.nuisance import left_by, make_error_tangents
from correlation.prediction import Points, Prediction, Predictor
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.comparison import Comparison


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulation:
    """Draws campaigns without anything missing.

    Parameters
    ----------
    campaign
        Whose tests are made again; states that jump are left out, as they are from every fit.
    arrangement
        Of this campaign: the fitted model, and how much repeats differ.
    held_out
        Whether what is held out is read as well; all else takes less than half the time.
    """

    campaign: Campaign
    arrangement: Arrangement
    held_out: bool = True

    def draw(self, generator: np.random.Generator) -> Campaign:
        """One campaign."""
        value = self.read(generator)
        measured = replace(self.campaign.measurement, value=value).where(np.isfinite(value))
        return replace(self.campaign, measurement=measured, suspicions=())

    def read(self, generator: np.random.Generator) -> Complex[NDArray[np.complex128], " rows"]:
        """Readings in the rows of the campaign's table; not a number where nothing is compared or no state is found."""
        table, used = self.campaign.measurement, self._used
        value = np.full(len(table), np.nan, dtype=np.complex128)
        error = self._error(generator)
        way = np.array([self._sweeps.index(sweep) if sweep in self._sweeps else 0 for sweep in table.sweep])
        for repeat in np.unique(table.repeat[used]):
            rows = used & (table.repeat == repeat)
            read = np.array(
                [self._features.values(self._features.of_values(each) + error) for each in self._repeat(generator)]
            )
            value[rows] = read[way[rows], self.point[rows]]
        real, imaginary = generator.standard_normal((2, len(table)))
        deviation = self._deviation[:, self.point] * np.sqrt(self._readings)
        return np.asarray(value + deviation[0] * real + 1j * deviation[1] * imaginary)

    @property
    def _sweeps(self) -> tuple[int, ...]:
        return self._predictor.sweeps

    @cached_property
    def _predictor(self) -> Predictor:
        """Of all points that are compared."""
        sides = [side.observed.points for side in self._sides]
        return Predictor(points=_joined(sides), sweeps=self.arrangement.train.predictor.sweeps)

    @property
    def _sides(self) -> tuple[Comparison, ...]:
        return (self.arrangement.train, *([self.arrangement.held_out] if self.held_out else []))

    @cached_property
    def _used(self) -> Bool[NDArray[np.bool_], " rows"]:
        """Which rows of the table are read."""
        held = [] if self.held_out else self.campaign.held_out.repeats
        return np.asarray((self.point >= 0) & ~np.isin(self.campaign.measurement.repeat, held))

    @cached_property
    def _prediction(self) -> Prediction:
        """Without anything random."""
        fit = self.arrangement.fit
        return self._predictor.predict(fit.model, fit.prediction)

    @cached_property
    def _features(self) -> FeatureVector:
        """What the error is linear in."""
        fundamental = np.concatenate([side.features.fundamental for side in self._sides])
        return FeatureVector.choose(self._predictor.points, self._prediction.value, fundamental)

    @cached_property
    def point(self) -> Int[NDArray[np.int64], " rows"]:
        """Row of the points that each row of the table is a reading of; -1 for what is not compared."""
        return find_points(self.campaign, self._predictor.points)

    @cached_property
    def _readings(self) -> Float[NDArray[np.float64], " rows"]:
        """How many readings of a point a repeat has."""
        _, same, count = np.unique(
            np.column_stack([self.point, self.campaign.measurement.repeat]), axis=0, return_inverse=True,
            return_counts=True,
        )  # fmt: skip
        return np.asarray(count[same.ravel()], dtype=np.float64)

    @cached_property
    def _deviation(self) -> Float[NDArray[np.float64], "2 k"]:
        """Noise of a repeat's reading of each point, real and imaginary, and none at all at place -1."""
        parts = [_noise(side) for side in self._sides]
        return np.column_stack([*parts, np.zeros(2)])

    def _repeat(self, generator: np.random.Generator) -> Complex[NDArray[np.complex128], "S k"]:
        """What one repeat reads in each sweep, without noise."""
        model, points = self._jittered(generator), self._predictor.points
        value = np.zeros((max(len(self._sweeps), 1), len(points)), dtype=np.complex128)
        value[:, points.free] = self._followed(model, points.free, None)
        for level in np.unique(points.level):
            share = generator.uniform(size=len(model.system.joints))
            there = ~points.free & (points.level == level)
            value[:, there] = self._followed(model, there, share)
        return value

    def _followed(
        self, model: Model, there: NDArray[np.bool_], share: Float[NDArray[np.float64], " joints"] | None
    ) -> Complex[NDArray[np.complex128], "S n"]:
        slider = None if share is None else left_by(model, share)
        predictor = replace(self._predictor, points=self._predictor.points.where(there), slider=slider)
        return predictor.predict(model, self._prediction).by_sweep

    def _jittered(self, generator: np.random.Generator) -> Model:
        """The model as it is in one repeat."""
        model = self.arrangement.fit.model
        # What is known is the jitter of a mean over the repeats held out.
        single = float(np.sqrt(np.median(self.arrangement.settled.observed.count)))
        for effect, deviation in self.arrangement.jitter:
            model = effect.apply(model, [single * deviation * float(generator.standard_normal())])
        return model

    def _error(self, generator: np.random.Generator) -> Float[NDArray[np.float64], " m"]:
        """Numerical error of each feature."""
        common, apart = self._errors
        error = common @ generator.standard_normal(common.shape[1])
        levels, number = np.unique(self._predictor.points.level, return_inverse=True)
        for change in apart.T:
            error = error + change * generator.standard_normal(len(levels))[number[self._features.row]]
        return np.asarray(error)

    @cached_property
    def _errors(self) -> tuple[Float[NDArray[np.float64], "m a"], Float[NDArray[np.float64], "m b"]]:
        """What numerical errors do to each feature at one standard deviation: to all levels alike, to each apart."""
        arrangement = self.arrangement
        fit, before = arrangement.fit, self._prediction
        errors = make_error_tangents(fit.model, arrangement.budget)
        rates = self._predictor.derivatives(fit.model, before, errors.tangents)
        slopes = self._features.slopes(before.value, rates) * errors.size
        apart = [*slopes[:, errors.whole :].T, *self._finer_changes()]
        # A state that one of them does not find has no error of this kind.
        return np.nan_to_num(slopes[:, : errors.whole]), np.nan_to_num(
            np.array(apart).reshape(len(apart), len(slopes)).T
        )

    def _finer_changes(self) -> list[Float[NDArray[np.float64], " m"]]:
        """What each finer model changes of each feature."""
        arrangement, fit, before = self.arrangement, self.arrangement.fit, self._prediction
        # They have what was added before, but not an effect that was fitted to see whether it is the one.
        common = arrangement.unknowns([])
        values = fit.values[: len(common.parameters)]
        if arrangement.finer and len(values) < len(fit.values):
            before = self._predictor.predict(common.compose(values), before)
        refined = [self._predictor.predict(each.compose(values), before) for each in arrangement.finer]
        return [self._features.of_values(each.value) - self._features.of_values(before.value) for each in refined]


def _joined(sides: list[Points]) -> Points:
    return Points(
        **{
            name: np.concatenate([getattr(side, name) for side in sides])
            for name in ("free", "level", "frequency", "sensor", "harmonic")
        }
    )


def _noise(side: Comparison) -> Float[NDArray[np.float64], "2 k"]:
    """Standard deviation of a repeat's reading by noise, real and imaginary part, shape (2, k)."""
    features, observed = side.features, side.observed
    deviation = side.noise / features.per_reading(observed.mean)
    k = len(observed.points)
    imaginary = np.zeros(k)
    imaginary[features.row[k:]] = deviation[k:]
    return np.array([deviation[:k], imaginary])
