r"""Steady states at measured motions: the force that a model needs to move as the structure was seen to move.

Under a given force a nonlinear structure may have several steady states, and a resonance that is off by its width moves
a response by its own size. Under a given motion of one sensor there is one state as a rule, and the force that it needs
changes smoothly with masses, stiffnesses and damping. With the reading :math:`y = D \lambda - C^T g_1` of the sensor,
the first harmonic :math:`\lambda` of the drive follows from what is read, and

.. math:: x_1 = \frac{d}{D}\, y - \left(A_1 - \frac{d\, C^T}{D}\right) g_1

is the balance of the joint directions with another linear motion and another receptance; all other harmonics stay.

At one frequency the force over the amplitude has an S shape where there are two states. A sweep under a given force
jumps where that is the local minimum (from the upper branch) or maximum (from the lower one) of the curve: its fold.

References
----------
Karaagacli and Ozguven, Experimental modal analysis of nonlinear systems by using response-controlled stepped-sine
testing, Mech. Syst. Signal Process. 146 (2021), 107023.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.model import Model
from correlation.model_solver import ModelSolver
from correlation.prediction import Points
from fe.blas_threads import on_one_blas_thread
from hbsolve.sampling import complex_from_real, real_from_complex
from hbsolve.solution import MAX_ITERATION, TOLERANCE
from hbsolve.state_sequence import StateSequence, Track, follow, make_empty_track

Coefficients = Complex[NDArray[np.complex128], " k"]
Motions = Float[NDArray[np.float64], "n d nh"]
Rows = Int[NDArray[np.int64], " n"]
#: Configuration, level [N] and direction of the sweep of a curve.
Curve = tuple[bool, float, int]

#: Amplitudes at which the force of a fold is computed, and how far they go beyond those of both branches [-].
AMPLITUDES, BEYOND = 48, 2.0


class Fold(NamedTuple):
    """End of a measured branch: the force at which a sweep jumped."""

    free: bool
    sensor: str
    """Sensor that is held."""
    frequency: float
    """[Hz]."""
    force: float
    """As it was [N]."""
    lower: float
    upper: float
    """Moduli of the sensor's readings on both branches."""
    leaves_upper: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlledPrediction:
    """Predicted coefficients under response control.

    Parameters
    ----------
    value
        Readings over the needed force, times the force as it was, and with its phase, shape (k,); static parts as they
        are; NaN where no steady state was found.
    fold
        Needed over measured force of each fold, shape (f,) [-]; NaN where the model has none.
    motion
        Motions of the joint directions in each state, by curve.
    """

    value: Coefficients
    fold: Float[NDArray[np.float64], " f"]
    motion: Mapping[Curve, Motions] = field(default_factory=dict)


class _Group(NamedTuple):
    """States of one curve by ascending frequency, the row that is held in each, and those that are read."""

    curve: Curve
    frequency: list[float]
    control: Rows
    rows: list[Rows]


class _ControlledStates(NamedTuple):
    """States under response control."""

    track: Track
    drive: Complex[NDArray[np.complex128], " n"]
    """Needed force [N]."""
    reading: Complex[NDArray[np.complex128], "n h s"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlledPredictor:
    """Predicts the force at measured motions.

    Parameters
    ----------
    points
        Points of measurement.
    measured
        Measured coefficients, shape (k,); without a phase their moduli.
    motion
        Mask of the fundamentals of motion sensors, shape (k,): the largest of each state is controlled.
    folds
        Measured ends of branches.
    """

    points: Points
    measured: Coefficients
    motion: Bool[NDArray[np.bool_], " k"]
    folds: tuple[Fold, ...] = ()

    @on_one_blas_thread
    def predict(self, model: Model, before: ControlledPrediction | None = None) -> ControlledPrediction:
        """Solve for all states in which a motion was measured.

        Parameters
        ----------
        model
            What is tested.
        before
            A prediction for a model nearby.
        """
        value, guesses = np.full(len(self.points), np.nan, dtype=np.complex128), {} if before is None else before.motion
        free = {group.curve[0] for group in self._groups} | {fold.free for fold in self.folds}
        solvers = {item: ModelSolver.from_model(model, item, None) for item in free}
        motion = {}
        for group in self._groups:
            solver = solvers[group.curve[0]]
            motion[group.curve] = self._read(solver, group, guesses.get(group.curve), value)
        needed = np.full(len(self.folds), np.nan)
        for number, fold in enumerate(self.folds):
            needed[number] = _find_fold_force(solvers[fold.free], fold) / fold.force
        return ControlledPrediction(value=value, fold=needed, motion=motion)

    def _read(self, solver: ModelSolver, group: _Group, guess: Motions | None, value: Coefficients) -> Motions:
        """Write the values of a curve, and return the motions of its joint directions."""
        points, force = self.points, self.points.force[group.control]
        held = _solve(solver, group.frequency, force, points.sensor[group.control], self.measured[group.control], guess)
        harmonic = np.arange(held.reading.shape[1])
        with np.errstate(invalid="ignore", divide="ignore"):
            size = np.abs(held.drive)
            # A shift of time gives the needed force the phase of the measured one.
            scale = (force / size)[:, None] * (np.conj(held.drive) / size)[:, None] ** harmonic
        scale[:, 0] = 1.0
        there = np.isfinite(held.track.norm)[:, None, None]
        reading = np.where(there, held.reading * scale[..., None], np.nan)
        for number, rows in enumerate(group.rows):
            value[rows] = reading[number, points.harmonic[rows], solver.numbers(points.sensor[rows])]
        return np.asarray(held.track.motion)

    @cached_property
    def _groups(self) -> list[_Group]:
        return list(self._list_groups())

    def _list_groups(self) -> Iterator[_Group]:
        """Curves with the states in which a motion was measured."""
        points, there = self.points, self.motion & (np.abs(np.nan_to_num(self.measured)) > 0)
        key = np.column_stack([points.free, points.level, points.sweep])
        for free, level, sweep in np.unique(key[there], axis=0):
            own = np.flatnonzero((key == (free, level, sweep)).all(axis=1))
            frequencies = np.unique(points.frequency[own[there[own]]])
            rows = [own[points.frequency[own] == frequency] for frequency in frequencies]
            held = [item[there[item]] for item in rows]
            largest = [item[np.argmax(np.abs(self.measured[item]))] for item in held]
            yield _Group((bool(free), float(level), int(sweep)), frequencies.tolist(), np.array(largest), rows)


def _solve(
    solver: ModelSolver,
    frequencies: Sequence[float],
    force: Float[NDArray[np.float64], " n"],
    sensors: NDArray[np.str_],
    held: Complex[NDArray[np.complex128], " n"],
    guess: Motions | None = None,
) -> _ControlledStates:
    """States in which a sensor's first harmonic is given, one after another, each with the sliders of the last one.

    Parameters
    ----------
    solver
        Solver of the configuration.
    frequencies, force
        Frequency, and amplitude of the force in all harmonics but the first, of each state [Hz, N].
    sensors, held
        Name of the sensor, and the prescribed values of its first harmonic, shape (n,).
    guess
        Motions nearby.
    """
    balance, n = solver.balance, len(frequencies)
    linear = solver.linear.stacked(tuple(frequencies))
    rows, _, order = solver.rows
    _, dynamic, contact, omega = solver.linear.read(tuple(frequencies), rows)
    state, sensor = np.arange(n), solver.numbers(sensors)
    # Readings are time derivatives, and those of a shaken base have its own motion in them.
    turned, base = (1j * omega[:, None]) ** order, solver.base[1] * (1j * omega[:, None]) ** (order - 2.0)
    through = (dynamic[:, 1] * turned + base)[state, sensor]
    by_force = contact[state, 1, sensor] * turned[state, sensor][:, None]
    stuck = linear.static + force[:, None, None] * linear.dynamic
    stuck[:, 1] = (held / through)[:, None] * linear.dynamic[:, 1]
    columns = linear.columns.copy()
    columns[:, 1] -= (by_force / through[:, None])[:, :, None] * linear.dynamic[:, 1, None, :]
    d, nh = balance.n_direction, 2 * balance.n_harmonic - 1
    from_guess = guess is not None and guess.shape == (n, d, nh)
    sequence = StateSequence(
        state, np.full(n, -1), linear.angular_frequency, real_from_complex(stuck), columns,
        guess if guess is not None and from_guess else np.full((n, d, nh), np.nan),
    )  # fmt: skip
    track, number, slider = make_empty_track(n, d, nh, balance.n_slider), 0, solver.slider.astype(float)
    while number < n:
        number = 1 + int(follow(
            number, True, from_guess, sequence, balance.arrays, slider, TOLERANCE, MAX_ITERATION, track
        ))  # fmt: skip
    g = complex_from_real(track.force)
    drive = (held + (by_force * g[:, 1]).sum(axis=1)) / through
    by_harmonic = np.repeat(force[:, None], g.shape[1], axis=1).astype(np.complex128)
    by_harmonic[:, 1] = drive
    return _ControlledStates(track, drive, solver.read_driven(by_harmonic[..., None], frequencies, track))


def _find_fold_force(solver: ModelSolver, fold: Fold) -> float:
    """Force at the fold of the S curve that is nearest to the branch that ends [N]; NaN if there is none."""
    ends = (fold.lower / BEYOND, fold.upper * BEYOND)
    amplitude = np.geomspace(*ends, AMPLITUDES)
    n = len(amplitude)
    held = _solve(
        solver, [fold.frequency] * n, np.full(n, fold.force), np.full(n, fold.sensor), amplitude.astype(complex)
    )
    with np.errstate(invalid="ignore"):
        x, y = np.log(amplitude), np.log(np.where(np.isfinite(held.track.norm), np.abs(held.drive), np.nan))
    sign = 1.0 if fold.leaves_upper else -1.0
    middle = sign * y[1:-1]
    inner = 1 + np.flatnonzero((middle < sign * y[:-2]) & (middle <= sign * y[2:]))
    if not len(inner):
        return np.nan
    left = np.log(fold.upper if fold.leaves_upper else fold.lower)
    nearest = int(inner[np.argmin(np.abs(x[inner] - left))])
    # The vertex of the parabola through three amplitudes at equal distances.
    low, here, high = y[nearest - 1 : nearest + 2]
    return float(np.exp(here - (high - low) ** 2 / (8 * (high - 2 * here + low))))
