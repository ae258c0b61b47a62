r"""How clearly an effect shows in a campaign: the whitened change of all readings that nothing accepted explains.

.. math:: z^2 = d^T (I + J J^T)^{-1} d

d is the change by the effect in standard deviations of the mean readings and of a usual model error (0.1 %), J one
column per standard deviation of each accepted parameter (kt, kn 10 %, mu 10 %, zeta 20 %, E 1 %), of each error of the
mesh that the case states (natural frequencies and shapes, stiffnesses of lines, the change by finer models), of the
preloads of the lines from repeat to repeat (1 %), and of three friction histories. z is about what chi-squared can fall
by, as a root.

A finite change d turns with the strength, as a peak that moves by more than its width does, and the straight columns of
J then leave much of it that finite steps of the same parameters take up. So z is the smaller one of that of the whole
change and that of its first twentieth, times twenty.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from benchmarks.strangers.blueprint import Blueprint
from benchmarks.strangers.hidden import Hidden
from benchmarks.strangers.layout import Layout
from benchmarks.strangers.response import Rows, points_of, predict
from correlation.model import LineSensor, Model
from correlation.noise.nuisance import Budget, highest_frequency, make_error_tangents, sliders_after_history
from correlation.prediction import Predictor
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from hbsolve.errors import ModelError

Vector = NDArray[np.float64]

#: Deviation of preloads [-], and how many histories.
PRELOAD, N_HISTORY = 1e-2, 3
#: Usual error of a model's readings [-], which no repeat makes smaller.
READING = 1e-3
#: First part of an effect's strength, whose change is straight [-].
PART = 0.05
#: Floor of a reading as a share of the noise on the largest one at the lowest level.
FLOOR = 0.2
#: Least reading of a load cell that its floor is made for, as a share of the highest force [-].
LEAST = 0.1


class Signature:
    """The signature of effects in a campaign of a layout on a model with its sensors."""

    def __init__(
        self, plan: Blueprint, layout: Layout, model: Model, budget: Budget, random: np.random.Generator
    ) -> None:
        self.layout, self.model = layout, model
        self.cells = {sensor.name for sensor in model.sensors if isinstance(sensor, LineSensor)}
        rows: Rows = []
        for grid in layout.grids:
            free = grid.configuration == "free"
            for sensor in layout.sensors:
                if free and sensor.name in self.cells:
                    continue
                harmonics = (0, 1) if sensor.name in self.cells else layout.harmonics
                for level in grid.levels:
                    rows += [(free, level, f, sensor.name, h) for f in grid.frequencies[::2] for h in harmonics]
        self.points = points_of(rows)
        self.base = predict(model, self.points)
        self.floor = self._floors(plan.force)
        self.count = layout.n_repeat * len(layout.ways) * 2  # every other frequency stands for two
        size = np.abs(self.base.value)
        floor = np.array([self.floor[name] for name in self.points.sensor.tolist()])
        self.deviation = np.sqrt(((layout.noise * size) ** 2 + floor**2) / 2 / self.count + (READING * size) ** 2 / 2)
        self.known = np.isfinite(self.base.value)
        self.nuisance = np.array(list(self._nuisances(budget, random)))

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

    def of(self, effect: Hidden) -> float:
        """z of an effect; 0 where the model with it has no steady states."""
        small = replace(effect, strength=effect.vanishes + PART * (effect.strength - effect.vanishes))
        try:
            whole, first = (self._change(each.bound(self.model)(self.model), each) for each in (effect, small))
        except (ModelError, ValueError):
            return 0.0
        return min(self.size(whole), self.size(first) / PART)

    def size(self, change: Vector) -> float:
        """z of a whitened change."""
        inner = np.eye(len(self.nuisance)) + self.nuisance @ self.nuisance.T
        along = self.nuisance @ change
        return float(np.sqrt(max(change @ change - along @ scipy.linalg.solve(inner, along, assume_a="pos"), 0.0)))

    def _change(self, model: Model, effect: Hidden | None = None) -> Vector:
        value = predict(model, self.points, self.base).value
        if effect is not None:
            late = np.array([effect.delay(name) for name in self.points.sensor.tolist()])
            value = value * np.exp(-2j * np.pi * self.points.frequency * self.points.harmonic * late)
        return self._whitened(value)

    def _whitened(self, value: NDArray[np.complex128]) -> Vector:
        """Change in standard deviations: of both parts, or of the amplitude where there is no phase."""
        there = self.known & np.isfinite(value)
        if not self.layout.sensors[0].has_phase:
            moved = np.abs(value) - np.abs(self.base.value)
            return np.where(there, moved / self.deviation, 0.0)
        return self._scaled(np.where(there, value - self.base.value, 0.0))

    def _scaled(self, change: NDArray[np.complex128]) -> Vector:
        """A small change in standard deviations."""
        scaled = np.where(self.known, change, 0.0) / self.deviation
        if not self.layout.sensors[0].has_phase:
            along = np.where(self.known, self.base.value, 1.0)
            return np.asarray((scaled * along.conj()).real / np.maximum(np.abs(along), 1e-300))
        return np.concatenate([scaled.real, scaled.imag])

    def _nuisances(self, budget: Budget, random: np.random.Generator) -> Iterator[Vector]:
        small, model = 0.05, self.model
        for parameter in list_calibration_parameters(model):
            factor = 1 + small * parameter.deviation
            yield self._change(parameter.apply(model, [factor])) / small
        errors = make_error_tangents(model, self.base, budget, highest_frequency(self.points))
        rates = Predictor(points=self.points).derivatives(model, self.base, errors.tangents)
        for rate, size in zip(rates.T, errors.size, strict=True):
            yield self._scaled(np.nan_to_num(size * rate))
        for finer in budget.refined:
            yield self._change(finer)
        for line in model.preloads:
            share = PRELOAD / np.sqrt(self.layout.n_repeat)
            if any(model.contact(name).preload for name in model.lines[line]):
                yield self._change(model.pressed(line, 1 + share))
        for _ in range(N_HISTORY if model.lines else 0):
            slider = sliders_after_history(model, random.uniform(size=len(model.system.joints)))
            yield self._whitened(predict(model, self.points, slider=slider).value) / np.sqrt(self.layout.n_repeat)
