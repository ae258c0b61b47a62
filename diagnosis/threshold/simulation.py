"""Simulated campaigns: the same tests with a fitted model and random errors.

Frequency shift and preloads are drawn for each repeat, a friction history for each level of a repeat, noise for each
reading; the numerical error of the model is common to all repeats. Histories are followed through stick and slip, since
their effect on a state is far from normally distributed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import find_points
from correlation.feature.vector import FeatureVector
from correlation.model import Model
from correlation.noise.error_patterns import ErrorPatterns
from correlation.noise.error_size import NO_ERROR
from correlation.noise.nuisance import (
    count_contact_sliders,
    find_highest_frequency,
    make_error_tangents,
    make_slider_start,
)
from correlation.prediction import Prediction, Predictor
from correlation.row_table import join_tables
from diagnosis.candidate.catalogue import Extra
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.comparison import Comparison


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulation:
    """Simulates campaigns without a missing effect.

    Parameters
    ----------
    campaign
        Campaign whose tests are simulated; states that jump are left out, as in every fit.
    arrangement
        Arrangement of this campaign: the fitted model, and the differences between repeats.
    held_out
        Whether held-out data are simulated as well; without them the time is less than half.
    extra
        The user's own effects, see `diagnosis.candidate.catalogue`.
    """

    campaign: Campaign
    arrangement: Arrangement
    held_out: bool = True
    extra: Sequence[Extra] = ()

    def draw(self, generator: np.random.Generator) -> Campaign:
        """One campaign."""
        value = self.read(generator)
        measured = replace(self.campaign.measurement, value=value).where(np.isfinite(value))
        return replace(self.campaign, measurement=measured, suspicions=())

    def read(self, generator: np.random.Generator) -> Complex[NDArray[np.complex128], " rows"]:
        """Readings in the rows of the campaign's table; NaN for rows that are not compared or have no steady state."""
        table, used = self.campaign.measurement, self._used_rows
        value = np.full(len(table), np.nan, dtype=np.complex128)
        error = self._error(generator)
        way = np.array([self._sweeps.index(sweep) if sweep in self._sweeps else 0 for sweep in table.sweep])
        for repeat in np.unique(table.repeat[used]):
            rows = used & (table.repeat == repeat)
            read = np.array(
                [self._features.values(self._features.of_values(item) + error) for item in self._repeat(generator)]
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
        """Predictor of all points that are compared."""
        sides = [side.observed.points for side in self._sides]
        return Predictor(points=join_tables(sides), sweeps=self.arrangement.train.predictor.sweeps)

    @property
    def _sides(self) -> tuple[Comparison, ...]:
        return (self.arrangement.train, *([self.arrangement.held_out] if self.held_out else []))

    @cached_property
    def _used_rows(self) -> Bool[NDArray[np.bool_], " rows"]:
        """Mask of the rows of the table that are read."""
        held = [] if self.held_out else self.campaign.held_out.repeats
        return np.asarray((self.point >= 0) & ~np.isin(self.campaign.measurement.repeat, held))

    @cached_property
    def _prediction(self) -> Prediction:
        """Prediction without random differences."""
        fit = self.arrangement.fit
        return self._predictor.predict(fit.model, fit.prediction)

    @cached_property
    def _features(self) -> FeatureVector:
        """Features, in which the errors are linear."""
        fundamental = np.concatenate([side.features.fundamental for side in self._sides])
        phased = np.concatenate([~side.features.amplitude for side in self._sides])
        return FeatureVector.choose(self._predictor.points, self._prediction.value, fundamental, phased)

    @cached_property
    def point(self) -> Int[NDArray[np.int64], " rows"]:
        """Index of the point of each row of the table; -1 for rows that are not compared."""
        return find_points(self.campaign, self._predictor.points)

    @cached_property
    def _readings(self) -> Float[NDArray[np.float64], " rows"]:
        """Number of readings of the same point and repeat, for each row of the table."""
        _, same, count = np.unique(
            np.column_stack([self.point, self.campaign.measurement.repeat]), axis=0, return_inverse=True,
            return_counts=True,
        )  # fmt: skip
        return np.asarray(count[same.ravel()], dtype=np.float64)

    @cached_property
    def _deviation(self) -> Float[NDArray[np.float64], "2 k"]:
        """Noise of a single repeat at each point, real and imaginary; zero at index -1."""
        parts = [_compute_noise(side) for side in self._sides]
        return np.column_stack([*parts, np.zeros(2)])

    def _repeat(self, generator: np.random.Generator) -> Complex[NDArray[np.complex128], "S k"]:
        """Readings of one repeat in each sweep, without noise."""
        model, points = self._draw_model(generator), self._predictor.points
        value = np.zeros((max(len(self._sweeps), 1), len(points)), dtype=np.complex128)
        value[:, points.free] = self._follow_sweep(model, points.free, None)
        for level in np.unique(points.level):
            history = generator.uniform(size=count_contact_sliders(model))
            there = ~points.free & (points.level == level)
            value[:, there] = self._follow_sweep(model, there, history)
        return value

    def _follow_sweep(
        self, model: Model, there: NDArray[np.bool_], history: Float[NDArray[np.float64], " sliders"] | None
    ) -> Complex[NDArray[np.complex128], "S n"]:
        slider = None if history is None else make_slider_start(model, history)
        predictor = replace(self._predictor, points=self._predictor.points.where(there), slider=slider)
        return predictor.predict(model, self._prediction).by_sweep

    def _draw_model(self, generator: np.random.Generator) -> Model:
        """Model of one repeat."""
        model = self.arrangement.fit.model
        for effect, deviation in self.arrangement.jitter_of_one_repeat:
            model = effect.apply(model, [deviation * float(generator.standard_normal())])
        return model

    def _error(self, generator: np.random.Generator) -> Float[NDArray[np.float64], " m"]:
        """Numerical error and model error of each feature."""
        common, apart = self._errors
        error = common @ generator.standard_normal(common.shape[1])
        if self.arrangement.model_error_size != NO_ERROR:
            together, own, part = self._model_errors
            error = error + together @ generator.standard_normal(together.shape[1])
            error = error + own * generator.standard_normal(int(part.max(initial=-1)) + 1)[part]
            error = error + own * generator.standard_normal(len(own))
        levels, number = np.unique(self._predictor.points.level, return_inverse=True)
        for change in apart.T:
            error = error + change * generator.standard_normal(len(levels))[number[self._features.row]]
        return np.asarray(error)

    @cached_property
    def _errors(self) -> tuple[Float[NDArray[np.float64], "m a"], Float[NDArray[np.float64], "m b"]]:
        """Change of each feature by one standard deviation of numerical errors: common to all levels, and per level."""
        arrangement = self.arrangement
        fit, prediction = arrangement.fit, self._prediction
        highest = find_highest_frequency(self._predictor.points)
        errors = make_error_tangents(fit.model, prediction, arrangement.budget, highest)
        rates = self._predictor.derivatives(fit.model, prediction, errors.tangents)
        slopes = self._features.slopes(prediction.value, rates) * errors.size
        apart = [*slopes[:, errors.n_shared :].T, *self._refinement_changes()]
        # The error is zero for a state that one of the models lacks.
        return np.nan_to_num(slopes[:, : errors.n_shared]), np.nan_to_num(
            np.array(apart).reshape(len(apart), len(slopes)).T
        )

    @cached_property
    def _model_errors(
        self,
    ) -> tuple[Float[NDArray[np.float64], "m c"], Float[NDArray[np.float64], " m"], Int[NDArray[np.int64], " m"]]:
        """Change of each feature by one standard deviation of the estimated model error.

        Returns
        -------
        Modes common to features; standard deviation of each feature, for an independent error and again for an error
        common to its part; part of each feature.
        """
        fit, features, size = self.arrangement.fit, self._features, self.arrangement.model_error_size
        predicted = features.of_values(self._prediction.value)
        patterns = ErrorPatterns.at(features, self._predictor, fit.model, self._prediction, predicted)
        return np.nan_to_num(patterns.modes(size)), np.nan_to_num(size.reading * patterns.reading), patterns.part

    def _refinement_changes(self) -> list[Float[NDArray[np.float64], " m"]]:
        """Change of each feature by each finer model."""
        arrangement, fit, prediction = self.arrangement, self.arrangement.fit, self._prediction
        # Finer models contain the added effects, but not the effect under test.
        common = arrangement.unknowns([])
        values = fit.values[: len(common.parameters)]
        if arrangement.finer and len(values) < len(fit.values):
            prediction = self._predictor.predict(common.compose(values), prediction)
        refined = [self._predictor.predict(item.compose(values), prediction) for item in arrangement.finer]
        return [self._features.of_values(item.value) - self._features.of_values(prediction.value) for item in refined]


def _compute_noise(side: Comparison) -> Float[NDArray[np.float64], "2 k"]:
    """Standard deviation of a reading of one repeat by noise, real and imaginary part, shape (2, k)."""
    features, observed = side.features, side.observed
    deviation = side.noise / features.per_reading(observed.mean)
    k = len(observed.points)
    imaginary = np.zeros(k)
    imaginary[features.row[k:]] = deviation[k:]
    return np.array([deviation[:k], imaginary])
