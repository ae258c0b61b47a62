"""Prediction of a model at the points of a campaign, and its derivatives with respect to the model.

All points of a configuration share the condensed structure of their frequency; each is solved from the state that the
model had there before (after a small change of the model one or two Newton steps are enough), else from its neighbour
in frequency.

Friction has memory: a sticking contact keeps its last force. Sweeps are therefore followed point by point, as they were
measured, up and then down; each point begins with the final sliders of the previous one.

If a structure has two steady states, a sweep stays on its branch until that ends. Newton's method may leave a branch
earlier if a step is large: a level with large steps is followed again, in steps as small as its branches require
(`correlation.sweep_path`); models that differ little share the result (`correlation.followed_step`).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.followed_step import FollowedStep, SweepStep
from correlation.model import Model
from correlation.model_solver import ModelSolver, Tangent
from correlation.row_table import RowTable
from correlation.sweep_path import SweepPath, find_wide_steps, is_same
from fe.blas_threads import on_one_blas_thread
from hbsolve.balance import HarmonicBalance
from hbsolve.solution import TOLERANCE
from hbsolve.state import SteadyState
from hbsolve.state_sequence import Track


@dataclass(frozen=True, kw_only=True, eq=False)
class Points(RowTable):
    """Points of measurement: k rows, each one harmonic of one sensor at one level and frequency.

    Parameters
    ----------
    free
        Whether the structure is without its contacts, shape (k,).
    level
        Set point of the force, shape (k,) [N]: rows of one level belong together.
    frequency
        Shape (k,) [Hz].
    sensor
        Name of the sensor, shape (k,).
    harmonic
        Shape (k,) [-].
    sweep
        Sweep whose branch a row is of, +1 up or -1 down; 0, the default, for the mean of all sweeps, shape (k,).
    force
        Amplitude of the force as it was, shape (k,) [N]; the level by default.
    """

    free: NDArray[np.bool_]
    level: Float[NDArray[np.float64], " k"]
    frequency: Float[NDArray[np.float64], " k"]
    sensor: NDArray[np.str_]
    harmonic: Int[NDArray[np.int64], " k"]
    sweep: Int[NDArray[np.int64], " k"] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    force: Float[NDArray[np.float64], " k"] = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not len(self.force):
            object.__setattr__(self, "force", self.level)
        if not len(self.sweep):
            object.__setattr__(self, "sweep", np.zeros(len(self.level), dtype=np.int64))


#: Relative difference of motions below which two sweeps count as one.
SAME_SWEEP = 1e-3
#: Configuration, level [N] and frequency [Hz] of one steady state.
Key = tuple[bool, float, float]


class SweepJump(NamedTuple):
    """Step of a sweep to another branch."""

    free: bool
    """Whether the structure is without its contacts."""
    level: float
    """Set point of the force [N]."""
    sweep: int
    """Direction of the sweep, +1 up, -1 down."""
    frequency: float
    """Middle of the smallest step that still jumps [Hz]."""
    falls: bool
    """Whether the amplitude falls along the sweep."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """Predicted coefficients at some points.

    Parameters
    ----------
    points
        Points of the k values.
    value
        Coefficients of e^{i k Omega t}, shape (k,) [SI unit of the sensor]; NaN where no steady state was found.
    states
        Steady states of the first sweep, to start other ones from.
    states_back
        Steady states of the sweep back, where there is one.
    by_sweep
        Coefficients of each of S sweeps, shape (S, k); `value` is their mean, or that of the row's own sweep.
    jumps
        Steps at which a sweep left its branch.
    followed
        Wide steps that were followed, for this model or one nearby.
    """

    points: Points
    value: Complex[NDArray[np.complex128], " k"]
    states: Mapping[Key, SteadyState]
    states_back: Mapping[Key, SteadyState] = field(default_factory=dict)
    by_sweep: Complex[NDArray[np.complex128], "S k"] = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    jumps: tuple[SweepJump, ...] = ()
    followed: Mapping[SweepStep, FollowedStep] = field(default_factory=dict)

    def where(self, rows: Bool[NDArray[np.bool_], " k"] | Int[NDArray[np.int64], " n"]) -> "Prediction":
        """Prediction at some of the points, by a mask or by their numbers; the states are those of all."""
        return replace(self, points=self.points.where(rows), value=self.value[rows], by_sweep=self.by_sweep[:, rows])


@dataclass(frozen=True, kw_only=True, eq=False)
class Predictor:
    """Predicts at fixed points.

    Parameters
    ----------
    points
        Points to predict at.
    slider
        Initial positions of all sliders, from the balance of the jointed structure [m]; zero by default.
    sweeps
        Directions in frequency that are followed one after another, +1 up, -1 down; their mean is predicted. None lets
        every point begin with the initial sliders.
    shared
        Configurations of a model by whether they are free; their linear structures serve other models, too, where
        these have the same.
    tolerance
        Residual relative to the linear motion, up to which `vary` solves [-].
    needs_all
        Whether the first state that is not found ends a prediction.
    """

    points: Points
    slider: Callable[[HarmonicBalance], NDArray[np.float64]] | None = None
    sweeps: tuple[int, ...] = ()
    shared: Mapping[bool, ModelSolver] = field(default_factory=dict)
    tolerance: float = TOLERANCE
    needs_all: bool = False

    @on_one_blas_thread
    def predict(self, model: Model, before: Prediction | None = None) -> Prediction:
        """Solve for all points.

        Parameters
        ----------
        model
            Model of the structure.
        before
            Prediction for a model nearby, whose states are near. A wide step that was followed for it is not followed
            again where its ends are near.

        Raises
        ------
        NoSteadyState
            A state is not found, with `needs_all`.
        """
        states: tuple[dict[Key, SteadyState], dict[Key, SteadyState]] = ({}, {})
        by_sweep, jumps = self._empty(), list[SweepJump]()
        followed = {} if before is None else dict(before.followed)
        for one in self._solve_levels(model, before, TOLERANCE, from_guess=False):
            result, left = self._put_on_branches(one, followed)
            jumps += left
            for state, frequency, sweep in zip(result, one.frequencies, one.sweep, strict=True):
                if state is not None:
                    states[sweep][(one.free, one.level, frequency)] = state
            self._read(one, by_sweep)
        return Prediction(
            points=self.points, value=self._value(by_sweep), states=states[0], states_back=states[1], by_sweep=by_sweep,
            jumps=tuple(jumps), followed=followed,
        )  # fmt: skip

    @on_one_blas_thread
    def vary(self, model: Model, before: Prediction) -> Complex[NDArray[np.complex128], " k"]:
        """Coefficients for a small change of a model, without the states, shape (k,).

        Each state starts from that of `before`, moved by what its neighbour has moved, so that a state beside a fold
        stays on its branch.

        Parameters
        ----------
        model, before
            Model with the change, and a prediction without it.

        Raises
        ------
        NoSteadyState
            As for `predict`.
        """
        by_sweep = self._empty()
        for one in self._solve_levels(model, before, self.tolerance, from_guess=True):
            self._read(one, by_sweep)
        return self._value(by_sweep)

    def _put_on_branches(
        self, one: "_LevelStates", followed: dict[SweepStep, FollowedStep]
    ) -> tuple[list[SteadyState | None], list[SweepJump]]:
        """States of a level, of which those of another branch than that of their sweep are replaced; its jumps.

        The steps that were followed for a model nearby are brought up to date.
        """
        states, jumps = one.solver.states(one.level, one.frequencies, one.track), list[SweepJump]()
        if not self.sweeps or one.free:
            return states, jumps
        wide = find_wide_steps(one.solver, one.level, one.frequencies, one.track) & (np.diff(one.sweep) == 0)
        if not wide.any():
            return states, jumps
        path, sweep = SweepPath(solver=one.solver, level=one.level, followed=followed), np.array(one.sweep)
        for number, direction in enumerate(self.sweeps):
            own = np.flatnonzero(sweep == number)
            result = [states[place] for place in own]
            on_path, points = path.follow([one.frequencies[place] for place in own], result, wide[own[:-1]])
            other = [place for place, pair in enumerate(zip(result, on_path, strict=True)) if not is_same(*pair)]
            one.solver.write(one.level, one.track, own[other], [on_path[place] for place in other])
            for place in other:
                states[own[place]] = on_path[place]
            jumps += [
                SweepJump(one.free, one.level, sweep=direction, frequency=point.frequency, falls=point.falls)
                for point in points
            ]
        return states, jumps

    def _empty(self) -> Complex[NDArray[np.complex128], "S k"]:
        return np.full((max(len(self.sweeps), 1), len(self.points)), np.nan, dtype=np.complex128)

    def _solve_levels(
        self, model: Model, before: Prediction | None, tolerance: float, *, from_guess: bool
    ) -> Iterator["_LevelStates"]:
        """All states, of one configuration and level after another."""
        known = ({}, {}) if before is None else (before.states, before.states_back)
        for free, levels in self._configurations:
            solver = self._solver(model, free)
            swept = bool(self.sweeps) and not free
            for level, groups in levels.items():
                order = [
                    (number, place)
                    for number, direction in enumerate(self.sweeps if swept else (1,))
                    for place in range(len(groups))[::direction]
                ]
                frequencies = [groups[place][0] for _, place in order]
                guesses = [
                    known[number].get((free, level, frequency)) or known[0].get((free, level, frequency))
                    for (number, _), frequency in zip(order, frequencies, strict=True)
                ]
                # A sweep comes from the state beside it. Where there are two states, the one that another model was in
                # would make a fit depend on its path.
                track = solver.follow(
                    level,
                    frequencies,
                    guesses,
                    tolerance,
                    carried=bool(self.sweeps),
                    from_guess=from_guess or not swept,
                    needs_all=self.needs_all,
                )
                yield _LevelStates(
                    solver, free, level, frequencies, [number for number, _ in order],
                    [groups[place][1] for _, place in order], track,
                )  # fmt: skip

    def _read(self, one: "_LevelStates", by_sweep: Complex[NDArray[np.complex128], "S k"]) -> None:
        """Write the readings of the points in the states of a level."""
        table = one.solver.read_track(one.level, one.frequencies, one.track)
        count = np.array([len(rows) for rows in one.rows])
        rows, state = np.concatenate(one.rows), np.repeat(np.arange(len(count)), count)
        names, which = self._sensors
        own, inverse = np.unique(which[rows], return_inverse=True)
        sensor = one.solver.numbers(names[own])[inverse]
        read = table[state, self.points.harmonic[rows], sensor]
        if max(one.sweep) == 0:
            # A test that does not sweep reads the same in all of them.
            by_sweep[:, rows] = read
        else:
            by_sweep[np.array(one.sweep)[state], rows] = read

    def _value(self, by_sweep: Complex[NDArray[np.complex128], "S k"]) -> Complex[NDArray[np.complex128], " k"]:
        """Value of each row in its own sweep, or the mean over the sweeps that have a state, shape (k,).

        NaN where the first sweep has no state.
        """
        value = by_sweep[0].copy()
        for other in by_sweep[1:]:
            value = np.where(np.isfinite(other), (value + other) / 2, value)
        for number, direction in enumerate(self.sweeps):
            value = np.where(self.points.sweep == direction, by_sweep[number], value)
        return np.asarray(value)

    @on_one_blas_thread
    def derivatives(
        self, model: Model, prediction: Prediction, tangents: Sequence["Tangent"]
    ) -> Complex[NDArray[np.complex128], "k p"]:
        """Derivative of each predicted value with respect to each parameter, by the implicit function theorem.

        Parameters
        ----------
        model
            Model of the prediction.
        prediction
            Prediction that the model made.
        tangents
            Rates of the model with each of p parameters.

        Returns
        -------
        Shape (k, p); NaN where there is no state.
        """
        slopes = np.full((len(self.points), len(tangents)), np.nan, dtype=np.complex128)
        for free, levels in self._configurations if tangents else ():
            solver = self._solver(model, free)
            rates = solver.rates(tangents)
            solver.linear.reciprocal.recover([frequency for groups in levels.values() for frequency, _ in groups])
            for level, groups in levels.items():
                for frequency, rows in groups:
                    state = prediction.states.get((free, level, frequency))
                    if state is None:
                        continue
                    names, harmonics = self.points.sensor[rows], self.points.harmonic[rows]
                    own = solver.slopes(state, frequency, names, harmonics, rates)
                    other = prediction.states_back.get((free, level, frequency))
                    if other is not None and not _is_alike(state, other):
                        back = solver.slopes(other, frequency, names, harmonics, rates)
                        direction = self.points.sweep[rows][:, None]
                        alone = np.where(direction == self.sweeps[0], own, back)
                        own = np.where(direction == 0, (own + back) / 2, alone)
                    slopes[rows] = own
        return slopes

    def _solver(self, model: Model, free: bool) -> ModelSolver:
        solver = ModelSolver.from_model(model, free, self.slider, self.shared.get(free))
        return replace(solver, force=self._force[free]) if self._force[free] else solver

    @cached_property
    def _force(self) -> dict[bool, dict[tuple[float, float], float]]:
        """Forces that are not those of their level, by configuration, level and frequency; one per steady state."""
        points, force = self.points, dict[bool, dict[tuple[float, float], float]]({False: {}, True: {}})
        for row in np.flatnonzero(points.force != points.level):
            key = float(points.level[row]), float(points.frequency[row])
            force[bool(points.free[row])].setdefault(key, float(points.force[row]))
        return force

    def share(self, model: Model) -> "Predictor":
        """The same predictor with the linear structures of a model stored, for models with other joints and loads."""
        shared = {free: ModelSolver.from_model(model, free, None) for free, _ in self._configurations}
        return replace(self, shared=shared)

    @cached_property
    def _sensors(self) -> tuple[NDArray[np.str_], Int[NDArray[np.int64], " k"]]:
        """Names of the sensors, each once, and which of them each row is of."""
        return np.unique(self.points.sensor, return_inverse=True)

    @cached_property
    def _configurations(self) -> list[tuple[bool, dict[float, list[tuple[float, NDArray[np.int64]]]]]]:
        """Rows by configuration, level and ascending frequency."""
        points = self.points
        order = np.lexsort((points.frequency, points.level, points.free))
        keys = np.column_stack([points.free, points.level, points.frequency])[order]
        starts = np.flatnonzero(np.r_[True, (keys[1:] != keys[:-1]).any(axis=1)][: len(keys)])
        result: dict[bool, dict[float, list[tuple[float, NDArray[np.int64]]]]] = {}
        for (free, level, frequency), rows in zip(keys[starts].tolist(), np.split(order, starts[1:]), strict=False):
            result.setdefault(bool(free), {}).setdefault(level, []).append((frequency, rows))
        return list(result.items())


class _LevelStates(NamedTuple):
    """States of one configuration and level, in their order."""

    solver: ModelSolver
    free: bool
    level: float
    frequencies: list[float]
    sweep: list[int]
    """Number of the sweep of each state."""
    rows: list[NDArray[np.int64]]
    """Rows of the points that each state is read at."""
    track: Track


def _is_alike(state: SteadyState, other: SteadyState) -> bool:
    """Whether both sweeps move alike, so that their derivatives do; static forces may differ."""
    apart = np.abs(state.displacement[1:] - other.displacement[1:]).max(initial=0.0)
    return bool(apart < SAME_SWEEP * np.abs(state.displacement[1:]).max(initial=0.0))
