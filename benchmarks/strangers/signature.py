"""Signature z of an effect in a campaign: the change of the readings that a fit without the effect does not reproduce.

The readings of the model with the effect, with the calibration parameters of the specimen and the forces of its tests,
are fitted by the model without the effect. The fit may set kt, kn, mu, zeta, E and the natural frequencies of sharp
resonances within their priors. The covariance includes noise, jitter of frequency and preload, friction histories, the
mesh errors stated in the case and a model error of the usual size. z is the square root of the remaining chi-squared,
without the few states with the largest contributions: a state that jumps shows the end of its branch, which tests do
not reproduce.
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

#: Standard deviations between repeats of the frequencies and forces of both configurations and of preloads [-].
JITTER = (FREQUENCY_JITTER, FREQUENCY_JITTER, 0.0, 0.0, PRELOAD_JITTER)
#: Symbols of the calibration parameters, in the order of `DEVIATION`.
SYMBOLS = ("kt", "kn", "mu", "zeta", "E")
#: Number of friction histories, as in a diagnosis. With fewer, readings without scatter in any of them would have too
#: much weight.
N_HISTORY = 16
#: Usual error of the readings of a model [-], which repeats do not reduce.
READING = 1e-3
#: Floor of a sensor relative to the noise of its largest reading at the lowest level [-].
FLOOR = 0.2
#: Smallest reading for the floor of a load cell, relative to the highest force [-].
LEAST = 0.1
#: Fractions of the strength that are fitted first: a strong effect moves a peak so far that a fit from the start does
#: not follow it.
WEAKER = (0.1, 0.3)
#: Largest number of predictions of a fit; fraction of the states, those with the largest misfit, that do not count [-].
EFFORT, JUMPS = 12, 0.05


class Signature:
    """Signatures of effects in a campaign of a layout, for a model with its sensors.

    Parameters
    ----------
    plan, layout, model
        Structure, tests and model of the case.
    factors
        Calibration parameters of the specimen, by the names of `DEVIATION`.
    droop
        Fraction of the force that remains at each frequency of a test, by name of the test [-].
    budget
        Numerical errors stated in the case.
    random
        Generator of the friction histories.
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
        """Absolute noise of each sensor [its unit]; load cells of open contacts have only this floor."""
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
        count = n_repeat * len(self.layout.ways) * 2  # each predicted frequency represents two measured ones
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
        """Signature z of an effect; 0 if the model with it has no steady states."""
        followed = self.true
        try:
            for part in WEAKER:
                weaker = replace(effect, strength=effect.vanishes + part * (effect.strength - effect.vanishes))  # type: ignore[type-var]
                followed, _ = self._fit(self._read(weaker), followed)
            measured = self._read(effect)
        except (ModelError, ValueError):
            return 0.0
        left = min(self._fit(measured, start)[1] for start in (np.zeros(len(self.true)), self.true, followed))
        # The deviations of the specimen's parameters from their priors do not count: they exist without the effect.
        return float(np.sqrt(max(left**2 - self.true @ self.true, 0.0)))

    def _read(self, effect: Hidden) -> Vector:
        """Features of the specimen with an effect."""
        value = self.predictor.predict(effect.bound(self.specimen)(self.specimen), self.base).value
        late = np.array([effect.delay(name) for name in self.points.sensor.tolist()])
        turn = self.points.frequency * self.points.harmonic * late
        return self.features.of_values(value * np.exp(-2j * np.pi * turn))

    def _fit(self, measured: Vector, start: Vector) -> tuple[Vector, float]:
        """Fit features without an effect; returns parameters [standard deviations of the priors] and remaining z."""
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
        """Values of the calibration parameters from deviations in standard deviations of their priors."""
        return self.unknowns.clipped(self.unknowns.vanishing + self.unknowns.prior * share)
