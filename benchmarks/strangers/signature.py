"""How clearly an effect shows in a campaign: what a fit of everything that is accepted leaves of its change.

The readings of the model with the effect, with the calibration parameters of the specimen and under the force of its
tests, are fitted by the model without it. The fit may set kt, kn, mu, zeta, E and the natural frequencies of sharp
resonances within their priors. The covariance holds noise, the frequency and the preload of the repeats, friction
histories, the errors of the mesh that the case states and a model error of the usual size. z is the root of the
chi-squared that is left, without the few states that have most of it: one that jumps tells where its branch ends, which
tests do not reproduce.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from benchmarks.strangers.blueprint import Blueprint
from benchmarks.strangers.hidden import Hidden
from benchmarks.strangers.layout import Layout
from benchmarks.strangers.measure import FREQUENCY_JITTER, PRELOAD_JITTER
from benchmarks.strangers.response import Rows, points_of
from benchmarks.strangers.specimen import DEVIATION
from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.model import LineSensor, Model
from correlation.noise.covariance import Whitening
from correlation.noise.error_patterns import ErrorPatterns
from correlation.noise.error_size import ErrorSize
from correlation.noise.nuisance import Budget, ModelFeatures, make_history_modes, make_nuisance_modes
from correlation.prediction import Prediction, Predictor
from diagnosis.fit.calibration_parameter import MAX_PRIOR_RESIDUAL, list_calibration_parameters
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.mode_correction import ModeCorrection, list_mode_corrections
from diagnosis.fit.reading_slopes import differentiate_readings
from diagnosis.fit.weighting import Measured
from hbsolve.errors import ModelError

Vector = NDArray[np.float64]

#: Deviations of the frequency of either configuration, of its force and of preloads from repeat to repeat [-].
JITTER = (FREQUENCY_JITTER, FREQUENCY_JITTER, 0.0, 0.0, PRELOAD_JITTER)
#: Symbols of the calibration parameters, in the order of `DEVIATION`.
SYMBOLS = ("kt", "kn", "mu", "zeta", "E")
#: Friction histories, as many as a diagnosis draws: readings whose scatter none of a few shows would tell too much.
N_HISTORY = 16
#: Usual error of a model's readings [-], which no repeat makes smaller.
READING = 1e-3
#: Floor of a reading as a share of the noise on the largest one at the lowest level.
FLOOR = 0.2
#: Least reading of a load cell that its floor is made for, as a share of the highest force [-].
LEAST = 0.1
#: Shares of a strength whose fits lead to that of the whole: what a strong effect does to a peak is seen from afar as
#: its loss, which no small change of parameters makes good.
WEAKER = (0.1, 0.3)
#: Predictions of a fit at most; share of the states that do not count, those with the largest misfit [-].
EFFORT, JUMPS = 12, 0.05


class Signature:
    """The signature of effects in a campaign of a layout on a model with its sensors.

    Parameters
    ----------
    plan, layout, model
        Structure, tests and model of the case.
    factors
        Calibration parameters of the specimen, by the names of `DEVIATION`.
    droop
        Share of the force that is left at each frequency of a test, by its name [-].
    budget
        Errors that the case states.
    random
        Draws the friction histories.
    """

    def __init__(
        self, plan: Blueprint, layout: Layout, model: Model, factors: Mapping[str, float],
        droop: Mapping[str, Vector], budget: Budget, random: np.random.Generator,
    ) -> None:  # fmt: skip
        self.layout, self.model = layout, model
        self.cells = {sensor.name for sensor in model.sensors if isinstance(sensor, LineSensor)}
        rows: Rows = []
        force: list[float] = []
        for grid in layout.grids:
            free = grid.configuration == "free"
            for sensor in layout.sensors:
                if free and sensor.name in self.cells:
                    continue
                harmonics = (0, 1) if sensor.name in self.cells else layout.harmonics
                left = np.repeat(droop[grid.name][::2], len(harmonics))
                for level in grid.levels:
                    rows += [(free, level, f, sensor.name, h) for f in grid.frequencies[::2] for h in harmonics]
                    force += (level * left).tolist()
        self.points = replace(points_of(rows), force=np.array(force))
        self.predictor = Predictor(points=self.points)
        self.base = self.predictor.predict(model)
        self.floor = self._floors(plan.force)
        motion = np.array([name not in self.cells for name in self.points.sensor.tolist()])
        phased = np.full(len(self.points), layout.sensors[0].has_phase) | ~motion
        self.features = FeatureVector.choose(self.points, self.base.value, motion, phased)
        value = self.base.value[:, None]
        observed = Observation(points=self.points, repeat=value, motion=motion, taken=np.isfinite(value), phased=phased)
        measured = Measured(observed=observed, features=self.features, predictor=self.predictor)
        sharp = list_mode_corrections(measured, model, budget)
        set_by_fits = [item.number for item in sharp if isinstance(item, ModeCorrection)]
        self.whitening = self._covariance(replace(budget, fitted=set_by_fits), int(random.integers(2**31)))
        accepted = [(item, item.deviation) for item in (*list_calibration_parameters(model), *sharp)]
        self.unknowns = Unknowns.from_effects(model, accepted, [])
        known = {symbol: factors[name] for symbol, name in zip(SYMBOLS, DEVIATION, strict=True)}
        unknowns = self.unknowns
        values = [known.get(*item) for item in zip(unknowns.names, unknowns.vanishing.tolist(), strict=True)]
        self.true = (np.array(values) - unknowns.vanishing) / unknowns.prior
        self.specimen = unknowns.compose(np.array(values))

    def _floors(self, force: float) -> dict[str, float]:
        """Absolute noise of each sensor [its unit]; load cells of contacts that are open read the floor alone."""
        lowest = self.points.level.min()
        floors = {}
        for sensor in self.layout.sensors:
            own = (self.points.sensor == sensor.name) & (self.points.level == lowest) & (self.points.harmonic < 2)
            own = own if own.any() else self.points.sensor == sensor.name
            largest = float(np.nanmax(np.abs(self.base.value[own])))
            least = LEAST * force if sensor.name in self.cells else 0.0
            floors[sensor.name] = FLOOR * self.layout.noise * max(largest, least)
        return floors

    def _covariance(self, budget: Budget, seed: int) -> Whitening:
        value, of, n_repeat = self.base.value, self.features, self.layout.n_repeat
        floor = np.array([self.floor[name] for name in self.points.sensor.tolist()])
        count = n_repeat * len(self.layout.ways) * 2  # every other frequency stands for two
        noise = np.hypot(self.layout.noise * np.abs(value), floor) / np.sqrt(2 * count)
        deviation = of.per_reading(value) * noise[of.row]
        there = np.isfinite(deviation)
        nominal = ModelFeatures(self.predictor, of, self.model, self.base)
        jitter, errors = make_nuisance_modes(nominal, budget, budget.refined)
        apart = [size * block for size, block in zip(JITTER, jitter, strict=False)]
        repeats = np.column_stack([*apart, make_history_modes(nominal, N_HISTORY, seed)]) / np.sqrt(n_repeat)
        stated = Whitening(
            deviation=np.where(there, deviation, 1.0),
            modes=np.where(there[:, None], np.column_stack([repeats, errors]), 0),
        )
        patterns = ErrorPatterns.at(of, self.predictor, self.model, self.base, of.of_values(value))
        return patterns.widen(stated, ErrorSize.usual(READING))

    def of(self, effect: Hidden) -> float:
        """z of an effect; 0 where the model with it has no steady states."""
        followed = self.true
        try:
            for part in WEAKER:
                weaker = replace(effect, strength=effect.vanishes + part * (effect.strength - effect.vanishes))  # type: ignore[type-var]
                followed, _ = self._fit(self._read(weaker), followed)
            measured = self._read(effect)
        except (ModelError, ValueError):
            return 0.0
        left = min(self._fit(measured, start)[1] for start in (np.zeros(len(self.true)), self.true, followed))
        # Without the effect the parameters of the specimen are as far from their priors.
        return float(np.sqrt(max(left**2 - self.true @ self.true, 0.0)))

    def _read(self, effect: Hidden) -> Vector:
        """Features of the model with an effect."""
        value = self.predictor.predict(effect.bound(self.specimen)(self.specimen), self.base).value
        late = np.array([effect.delay(name) for name in self.points.sensor.tolist()])
        turn = self.points.frequency * self.points.harmonic * late
        return self.features.of_values(value * np.exp(-2j * np.pi * turn))

    def _fit(self, measured: Vector, start: Vector) -> tuple[Vector, float]:
        """Fit of these features without an effect, in standard deviations of the priors, and what it leaves as z."""
        states: dict[bytes, tuple[Model, Prediction]] = {}

        def at(share: Vector) -> tuple[Model, Prediction]:
            if share.tobytes() not in states:
                model = self.unknowns.compose(self._values(share))
                states[share.tobytes()] = model, self.predictor.predict(model, self.base)
            return states[share.tobytes()]

        def residual(share: Vector) -> Vector:
            left = measured - self.features.of_values(at(share)[1].value)
            return np.concatenate([self.whitening(np.nan_to_num(left)), share])

        def slopes(share: Vector) -> NDArray[np.float64]:
            (model, prediction), values = at(share), self._values(share)
            rates = differentiate_readings(self.predictor, self.unknowns, values, model, prediction)
            changes = self.features.slopes(prediction.value, self.unknowns.prior * rates)
            there = np.isfinite(changes) & np.isfinite(measured)[:, None]
            return np.concatenate([-self.whitening(np.where(there, changes, 0.0)), np.eye(len(share))])

        result = scipy.optimize.least_squares(
            residual, start, slopes, bounds=(-MAX_PRIOR_RESIDUAL, MAX_PRIOR_RESIDUAL), max_nfev=EFFORT, ftol=1e-3
        )
        by_state = np.sort(np.bincount(self.features.state, result.fun[: len(measured)] ** 2))
        counted = by_state[: len(by_state) - int(np.ceil(JUMPS * len(by_state)))]
        return result.x, float(np.sqrt(counted.sum() + result.x @ result.x))

    def _values(self, share: Vector) -> Vector:
        """Values of the calibration parameters that are so many standard deviations of their priors from the case."""
        return self.unknowns.clipped(self.unknowns.vanishing + self.unknowns.prior * share)
