"""Prediction of a model at the points of a campaign, and its derivatives with respect to the model.

All points of a configuration share the condensed structure of their frequency; each is solved from the state that the
model had there before (after a small change of the model one or two Newton steps are enough), else from its neighbour
in frequency.

Friction remembers: a contact that sticks keeps the force that it was left with. Sweeps are therefore followed point by
point, as they were measured, up and then down; each point begins with the sliders where the last one left them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.configuration import Configuration, Tangent
from correlation.model import Model
from correlation.row_table import RowTable
from fe.blas_threads import on_one_blas_thread
from hbsolve.balance import HarmonicBalance
from hbsolve.state import SteadyState


@dataclass(frozen=True, kw_only=True, eq=False)
class Points(RowTable):
    """Points of measurement: k rows, each one harmonic of one sensor at one level and frequency.

    Parameters
    ----------
    free
        Whether the structure is without its contacts, shape (k,).
    level
        Shape (k,) [N].
    frequency
        Shape (k,) [Hz].
    sensor
        Name of the sensor, shape (k,).
    harmonic
        Shape (k,) [-].
    """

    free: NDArray[np.bool_]
    level: Float[NDArray[np.float64], " k"]
    frequency: Float[NDArray[np.float64], " k"]
    sensor: NDArray[np.str_]
    harmonic: Int[NDArray[np.int64], " k"]


#: Relative difference of motions below which two sweeps count as one.
ALIKE = 1e-3
#: Configuration, level [N] and frequency [Hz] of one steady state.
Key = tuple[bool, float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """Predicted coefficients at some points.

    Parameters
    ----------
    points
        Where.
    value
        Coefficients of e^{i k Omega t}, shape (k,) [SI unit of the sensor]; NaN where no steady state was found.
    states
        The steady states of the first sweep, to start other ones from.
    others
        Those of the sweep back, where it was followed.
    by_sweep
        The coefficients of each sweep that was followed, shape (S, k); `value` is their mean.
    """

    points: Points
    value: Complex[NDArray[np.complex128], " k"]
    states: Mapping[Key, SteadyState]
    others: Mapping[Key, SteadyState] = field(default_factory=dict)
    by_sweep: Complex[NDArray[np.complex128], "S k"] = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))


@dataclass(frozen=True, kw_only=True, eq=False)
class Predictor:
    """Predicts at fixed points.

    Parameters
    ----------
    points
        Where.
    slider
        Initial positions of all sliders, from the balance of the jointed structure [m]; zero by default.
    sweeps
        Directions in frequency that are followed one after another, +1 up, -1 down; their mean is predicted. None lets
        every point begin with the initial sliders.
    linear
        The jointed structure of the one model that is predicted, from `Configuration.from_model`, for several
        predictors that differ in their sliders alone; found anew for each model by default.
    """

    points: Points
    slider: Callable[[HarmonicBalance], NDArray[np.float64]] | None = None
    sweeps: tuple[int, ...] = ()
    linear: Configuration | None = None

    @on_one_blas_thread
    def predict(self, model: Model, before: Prediction | None = None) -> Prediction:
        """Solve for all points.

        Parameters
        ----------
        model
            What is tested.
        before
            A prediction for a model nearby.
        """
        value = np.full(len(self.points), np.nan, dtype=np.complex128)
        by_sweep = np.full((max(len(self.sweeps), 1), len(self.points)), np.nan, dtype=np.complex128)
        both: tuple[dict[Key, SteadyState], dict[Key, SteadyState]] = ({}, {})
        known = ({}, {}) if before is None else (before.states, before.others)
        for free, levels in self._configurations:
            solver = self._solver(model, free)
            ways = (1,) if free or not self.sweeps else self.sweeps
            for level, groups in levels.items():
                sliders = solver.slider
                for number, way in enumerate(ways):
                    neighbour: SteadyState | None = None
                    for frequency, rows in groups[::way]:
                        key = (free, level, frequency)
                        first = both[0].get(key)
                        if number and first is not None and np.array_equal(first.slider, sliders):
                            state: SteadyState | None = first
                        else:
                            start = known[number].get(key) or known[0].get(key)
                            # A sweep comes from the state beside it. Where there are two states, the one that another
                            # model was in would make a fit depend on its path.
                            guesses = (neighbour, start) if self.sweeps and not free else (start, neighbour)
                            state = solver.solve(level, frequency, sliders, guesses)
                        if state is None:
                            continue
                        neighbour = both[number][key] = state
                        sliders = state.slider_at_start if self.sweeps else sliders
                        read = solver.read(state, self.points.sensor[rows], self.points.harmonic[rows])
                        value[rows] = read if number == 0 else (value[rows] + read) / 2
                        # A test that does not sweep reads the same in all of them.
                        by_sweep[number if len(ways) > 1 else slice(None), rows] = read
        return Prediction(points=self.points, value=value, states=both[0], others=both[1], by_sweep=by_sweep)

    @on_one_blas_thread
    def derivatives(
        self, model: Model, prediction: Prediction, tangents: Sequence["Tangent"]
    ) -> Complex[NDArray[np.complex128], "k p"]:
        """Derivative of each predicted value with respect to each parameter, by the implicit function theorem.

        Parameters
        ----------
        model
            With which the prediction was made.
        prediction
            There.
        tangents
            How the model's data change with each parameter.

        Returns
        -------
        Shape (k, p); NaN where there is no state.
        """
        slopes = np.full((len(self.points), len(tangents)), np.nan, dtype=np.complex128)
        for free, levels in self._configurations:
            solver = self._solver(model, free)
            for level, groups in levels.items():
                for frequency, rows in groups:
                    state = prediction.states.get((free, level, frequency))
                    if state is None:
                        continue
                    names, harmonics = self.points.sensor[rows], self.points.harmonic[rows]
                    slopes[rows] = solver.slopes(state, solver.at(frequency), names, harmonics, tangents)
                    other = prediction.others.get((free, level, frequency))
                    if other is not None and not _alike(state, other):
                        back = solver.slopes(other, solver.at(frequency), names, harmonics, tangents)
                        slopes[rows] = (slopes[rows] + back) / 2
        return slopes

    def _solver(self, model: Model, free: bool) -> Configuration:
        if self.linear is None or free:
            return Configuration.from_model(model, free, self.slider)
        return self.linear.starting(self.slider)

    @cached_property
    def _configurations(self) -> list[tuple[bool, dict[float, list[tuple[float, NDArray[np.int64]]]]]]:
        """Rows by configuration, level and ascending frequency."""
        points = self.points
        order = np.lexsort((points.frequency, points.level, points.free))
        found: dict[bool, dict[float, list[tuple[float, list[int]]]]] = {}
        for row in order:
            free, level, frequency = bool(points.free[row]), float(points.level[row]), float(points.frequency[row])
            groups = found.setdefault(free, {}).setdefault(level, [])
            if not groups or groups[-1][0] != frequency:
                groups.append((frequency, []))
            groups[-1][1].append(int(row))
        return [
            (free, {level: [(f, np.array(rows)) for f, rows in groups] for level, groups in levels.items()})
            for free, levels in found.items()
        ]


def _alike(state: SteadyState, other: SteadyState) -> bool:
    """Whether both sweeps move alike, so that their derivatives do; static forces may differ."""
    apart = np.abs(state.displacement[1:] - other.displacement[1:]).max(initial=0.0)
    return bool(apart < ALIKE * np.abs(state.displacement[1:]).max(initial=0.0))
