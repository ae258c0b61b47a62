"""Solver of a model in one configuration, with or without its contacts: steady states and sensor readings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import name_configuration
from correlation.linear_structure import LinearStructure
from correlation.model import DERIVATIVE, LoadCell, Model, Sensor
from hbsolve.aft import JointForces
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.errors import NoSteadyState
from hbsolve.joint_law.registry import FORCE, PARAMETERS
from hbsolve.model_rates import ModelParameter, ModelRates
from hbsolve.sampling import complex_from_real, real_from_complex
from hbsolve.sensitivity import ReadingResponse, derivatives
from hbsolve.solution import MAX_ITERATION, STEP_ITERATION, TOLERANCE, forces_at, newton_from, solve_at
from hbsolve.state import SteadyState, make_initial_sliders
from hbsolve.state_sequence import StateSequence, Track, follow, follow_one, make_empty_track
from hbsolve.steady_state import solve_from_other_starts

#: Motions of two sweeps whose relative difference is larger are of two branches; Newton's method ends at 1e-9 [-].
ONE_BRANCH = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class Tangent:
    """Rates of a model with one parameter.

    Parameters
    ----------
    jointed, free
        Rates of the structure's data in either configuration.
    gain, delay
        Rate of each sensor's gain and of its delay [s], by its name.
    frequency_shift
        Relative rate of the true frequency, by configuration, as far as velocities and accelerations are read with it;
        what it does to the structure is among the rates of the data.
    """

    jointed: ModelParameter
    free: ModelParameter
    gain: Mapping[str, float]
    delay: Mapping[str, float] = field(default_factory=dict)
    frequency_shift: Mapping[str, float] = field(default_factory=dict)


class Rates(NamedTuple):
    """Rates of p parameters, as one configuration has them."""

    system: ModelRates
    gain: Float[NDArray[np.float64], "s p"]
    """Relative rate of each sensor's gain."""
    delay: Float[NDArray[np.float64], "s p"]
    """Rate of each sensor's delay [s]."""
    frequency_shift: Float[NDArray[np.float64], " p"]
    """As in `Tangent`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelSolver:
    """Harmonic balance of one configuration, and the readings of its sensors.

    Parameters
    ----------
    free
        Whether the contacts of all lines are left out.
    model
        As it is in this configuration.
    balance
        Harmonic balance of its system.
    linear
        The linear structure at the frequencies seen so far.
    levels
        The balance at the levels seen so far, by level [N].
    slider
        Initial positions of the sliders, shape (s,) [m].
    force
        Amplitudes of the force by level and frequency, where they were not those of the level [N, Hz -> N].
    by_load
        Displacement at each sensor under a unit load on each degree of freedom, by frequency, shape (H + 1, r, s).
    """

    free: bool
    model: Model
    balance: HarmonicBalance
    linear: LinearStructure
    levels: dict[float, HarmonicBalance]
    slider: NDArray[np.float64]
    force: Mapping[tuple[float, float], float] = field(default_factory=dict)
    by_load: dict[float, Complex[NDArray[np.complex128], "h r s"]] = field(default_factory=dict)

    @classmethod
    def from_model(
        cls,
        model: Model,
        free: bool,
        slider: Callable[[HarmonicBalance], NDArray[np.float64]] | None,
        near: "ModelSolver | None" = None,
    ) -> "ModelSolver":
        """Solver of a model, without contacts if it is `free`.

        Parameters
        ----------
        model
            What is tested.
        free
            Whether its contacts are left out.
        slider
            Gives initial positions of the sliders [m]; zero by default.
        near
            The same configuration of another model, whose linear structure serves this one too if it is the same.
        """
        configured = model.without_contacts() if free else model
        balance = None if near is None else near.linear.balance_of(configured.system, model.n_harmonic, model.n_sample)
        if balance is None:
            balance = HarmonicBalance(system=configured.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
            near = None
        shift = model.frequency_shift.get(name_configuration(free), 0.0)
        linear = LinearStructure.from_balance(balance, shift, None if near is None else near.linear)
        start = np.zeros(balance.n_slider) if slider is None or free else slider(balance)
        return cls(free=free, model=configured, balance=balance, linear=linear, levels={}, slider=start)

    def at(self, frequency: float) -> Condensed:
        """The linear structure at a frequency, kept for the other levels."""
        return self.linear.at(frequency)

    def forced(self, level: float, frequency: float) -> float:
        """Amplitude of the force at a level and frequency [N]."""
        return self.force.get((level, frequency), level) * (1 + self.model.force_error.get(self.configuration, 0.0))

    def _forced_all(self, level: float, frequencies: Sequence[float]) -> Float[NDArray[np.float64], "n 1 1"]:
        return np.array([self.forced(level, frequency) for frequency in frequencies])[:, None, None]

    @property
    def configuration(self) -> str:
        """Its name."""
        return name_configuration(self.free)

    def solve(
        self,
        level: float,
        frequency: float,
        slider: NDArray[np.float64],
        guesses: Sequence[SteadyState | NDArray[np.float64] | None],
    ) -> SteadyState | None:
        """The steady state that the first successful guess leads to, else any that is found; None if there is none."""
        condensed, balance = self.at(frequency), self._at_level(self.forced(level, frequency))
        sliders = make_initial_sliders(balance, slider)
        shape = (balance.n_direction, 2 * balance.n_harmonic - 1)
        motions = [item.motion if isinstance(item, SteadyState) else item for item in guesses if item is not None]
        starts = [motion for motion in motions if motion.shape == shape]
        if starts:
            track = follow_one(balance, condensed, slider, starts[0], MAX_ITERATION)
            if (state := self.states(level, [frequency], track)[0]) is not None:
                return state
        # For a single state the recovery of all would cost more than its response.
        recovery = self.linear.recovery(frequency) if balance.is_dense else None
        try:
            return solve_at(balance, condensed, None, sliders, recovery)
        except NoSteadyState:
            for start in starts[1:]:
                result = newton_from(balance, condensed, start, sliders, recovery)
                if result is not None:
                    return result
        return solve_from_other_starts(balance, condensed, None, sliders)

    def follow_near(
        self,
        level: float,
        frequency: float,
        slider: NDArray[np.float64],
        guess: Complex[NDArray[np.complex128], "harmonic d"],
    ) -> Track:
        """The steady state that a few iterations of Newton's method find from a motion, as a track of one."""
        condensed, balance = self.at(frequency), self._at_level(self.forced(level, frequency))
        return follow_one(balance, condensed, slider, real_from_complex(guess), STEP_ITERATION)

    def follow(
        self,
        level: float,
        frequencies: Sequence[float],
        guesses: Sequence[SteadyState | None],
        tolerance: float = TOLERANCE,
        *,
        carried: bool,
        from_guess: bool,
        needs_all: bool = False,
    ) -> Track:
        """The steady states at one level, one after another.

        Parameters
        ----------
        level
            [N].
        frequencies
            Of the states, in their order; a frequency may come twice [Hz].
        guesses
            States that may be near.
        tolerance
            Residual relative to the linear motion, up to which Newton's method solves [-].
        carried
            Whether each begins with the final sliders of the one before.
        from_guess
            Whether each starts from its guess, and not from the one before.
        needs_all
            Whether the first state that is not found ends the search.

        Raises
        ------
        NoSteadyState
            A state is not found, with `needs_all`.
        """
        balance, linear = self._at_level(level), self.linear.stacked(tuple(sorted(set(frequencies))))
        indices = {frequency: index for index, frequency in enumerate(sorted(set(frequencies)))}
        d, nh, n = balance.n_direction, 2 * balance.n_harmonic - 1, len(frequencies)
        guess, earlier_state, firsts = np.full((n, d, nh), np.nan), np.full(n, -1), dict[float, int]()
        known = [None if state is None else state.displacement for state in guesses]
        own = [
            number for number, item in enumerate(known) if item is not None and item.shape == (balance.n_harmonic, d)
        ]
        guess[own] = real_from_complex(
            np.array([known[number] for number in own]).reshape(len(own), balance.n_harmonic, d)
        )
        first = np.array([firsts.setdefault(item, number) for number, item in enumerate(frequencies)], dtype=np.int64)
        # Where two sweeps are, or may be, on two branches the way back is no copy of the first.
        again = np.flatnonzero(
            (first < np.arange(n)) & (_are_on_one_branch(guess[first], guess) if from_guess else True)
        )
        if carried:
            earlier_state[again] = first[again]
        index = np.array([indices[frequency] for frequency in frequencies], dtype=np.int64)
        stuck = real_from_complex(linear.static + self._forced_all(level, list(indices)) * linear.dynamic)
        sequence = StateSequence(index, earlier_state, linear.angular_frequency, stuck, linear.columns, guess)
        track, slider, number = make_empty_track(n, d, nh, balance.n_slider), self.slider.astype(float), 0
        while number < n:
            number = int(follow(
                number, carried, from_guess, sequence, balance.arrays, slider, tolerance, MAX_ITERATION, track
            ))  # fmt: skip
            if number < n:
                slider = self._solve_one_state(
                    level, frequencies[number], guesses[number], number, track, slider, carried
                )
                if needs_all and not np.isfinite(track.norm[number]):
                    raise NoSteadyState(f"no steady state at {level:.4g} N and {frequencies[number]:.6g} Hz")
                number += 1
        return track

    def _solve_one_state(
        self,
        level: float,
        frequency: float,
        guess: SteadyState | None,
        number: int,
        track: Track,
        slider: NDArray[np.float64],
        carried: bool,
    ) -> NDArray[np.float64]:
        """Solve for a state at which Newton's method failed, and write it into a track.

        Returns
        -------
        Initial sliders of the next state.
        """
        before = track.motion[number - 1] if number and np.isfinite(track.norm[number - 1]) else None
        state = self.solve(level, frequency, track.initial_slider[number], [before, guess])
        if state is None:
            return np.array(track.initial_slider[number]) if carried else slider
        forces = forces_at(self._at_level(level), state.angular_frequency, state.motion, state.sliders, FORCE)
        track.motion[number], track.force[number] = state.motion, forces.coefficients
        track.periodic_slider[number], track.norm[number] = state.periodic_slider, state.residual_norm
        track.iterations[number] = state.iterations
        return np.array(state.periodic_slider) if carried else slider

    def write(
        self, level: float, track: Track, numbers: Int[NDArray[np.int64], " n"], states: Sequence[SteadyState | None]
    ) -> None:
        """Write states into a track at some of its numbers, where there are any."""
        balance = self._at_level(level)
        for number, state in zip(numbers, states, strict=True):
            track.norm[number] = np.nan
            if state is None:
                continue
            forces = forces_at(balance, state.angular_frequency, state.motion, state.sliders, FORCE)
            track.motion[number], track.force[number] = state.motion, forces.coefficients
            track.initial_slider[number], track.periodic_slider[number] = state.initial_slider, state.periodic_slider
            track.norm[number], track.iterations[number] = state.residual_norm, state.iterations

    def states(self, level: float, frequencies: Sequence[float], track: Track) -> list[SteadyState | None]:
        """States of a track with their full responses; None for a missing state.

        Parameters
        ----------
        level, frequencies, track
            As `follow` takes and returns them.
        """
        displacement = complex_from_real(track.motion)
        initial, periodic = track.initial_slider.copy(), track.periodic_slider.copy()
        states: list[SteadyState | None] = [None] * len(frequencies)
        known = np.flatnonzero(np.isfinite(track.norm)).tolist()
        responses = self._respond_each(
            level, [frequencies[number] for number in known], complex_from_real(track.force[known])
        )
        for number, response in zip(known, responses, strict=True):
            states[number] = SteadyState(
                angular_frequency=self.at(frequencies[number]).angular_frequency,
                level=self.forced(level, frequencies[number]),
                displacement=displacement[number],
                coefficients=response,
                initial_slider=initial[number],
                multiplier=False,
                periodic_slider=periodic[number],
                residual_norm=float(track.norm[number]),
                iterations=int(track.iterations[number]),
            )
        return states

    def _respond_each(
        self, level: float, frequencies: Sequence[float], joint_force: Complex[NDArray[np.complex128], "n h d"]
    ) -> Sequence[Complex[NDArray[np.complex128], "h r"]]:
        """Full responses to the loads at a level and joint forces, one state at each of n frequencies [m]."""
        condensed, structure = [self.at(frequency) for frequency in frequencies], self.balance.structure
        if self.balance.is_dense:
            levels = [self._at_level(self.forced(level, frequency)) for frequency in frequencies]
            recoveries = [self.linear.recovery(frequency) for frequency in frequencies]
            rows = zip(levels, condensed, joint_force, recoveries, strict=True)
            return [balance.respond(item, force, recovery) for balance, item, force, recovery in rows]
        load = structure.static + self._forced_all(level, frequencies) * structure.dynamic
        responses = structure.displacements_at_own_frequency(condensed, load - joint_force @ structure.directions)
        responses[:, 0] = responses[:, 0].real
        return list(responses)

    def read_track(
        self, level: float, frequencies: Sequence[float], track: Track
    ) -> Complex[NDArray[np.complex128], "n h s"]:
        """Readings of all sensors in the states of a track, shape (n, H + 1, s); NaN where there is no state."""
        return self.read_driven(self._forced_all(level, frequencies), frequencies, track)

    def read_driven(
        self,
        drive: Float[NDArray[np.float64], "n 1 1"] | Complex[NDArray[np.complex128], "n h 1"],
        frequencies: Sequence[float],
        track: Track,
    ) -> Complex[NDArray[np.complex128], "n h s"]:
        """The same under forces of any phase, shape (n, H + 1, 1), or (n, 1, 1) for all harmonics alike."""
        motion, force, order = self.rows
        static, dynamic, contact, omega = self.linear.read(tuple(frequencies), motion)
        g = complex_from_real(track.force)
        read = static + drive * dynamic - (contact @ g[..., None])[..., 0]
        read[:, 0] = read[:, 0].real
        times = 1j * np.arange(read.shape[1])[None, :, None] * omega[:, None, None]
        joint_force = g + self.balance.table.reference * complex_from_real(track.motion)
        readings = read * times**order + joint_force @ force.T
        readings[:, 0] += self.at_rest
        if self.model.base_acceleration is not None:
            for k in range(1, len(self.base)):
                own = drive[:, min(k, drive.shape[1] - 1)]
                readings[:, k] += own * (1j * k * omega[:, None]) ** (order - 2.0) * self.base[k]
        return self._delay_readings(np.asarray(readings), times)

    @cached_property
    def base(self) -> Complex[NDArray[np.complex128], "h s"]:
        """Acceleration of a shaken base that adds to the relative motion of each sensor, at level 1, shape (h, s)."""
        base = self.model.base_acceleration
        if base is None:
            return np.zeros((2, len(self.model.sensors)), dtype=np.complex128)
        absolute = [isinstance(item, Sensor) and not item.relative for item in self.model.sensors]
        return np.where(absolute, base @ self.rows[0].T, 0.0)

    def read(
        self, state: SteadyState, names: NDArray[np.str_], harmonics: NDArray[np.int64]
    ) -> Complex[NDArray[np.complex128], " k"]:
        """Readings of sensors in a state, one harmonic each, shape (k,)."""
        forces = forces_at(self._at_level(state.level), state.angular_frequency, state.motion, state.sliders, FORCE)
        return np.asarray(self._read(state, forces)[harmonics, self.numbers(names)])

    def _read(self, state: SteadyState, forces: JointForces) -> Complex[NDArray[np.complex128], "h s"]:
        """Readings of all sensors in a state, in which the joints have these forces."""
        of_joints = complex_from_real(forces.coefficients) + self.balance.table.reference * state.displacement
        table = self._readings(state.coefficients @ self.rows[0].T, of_joints, state)
        table[0] += self.at_rest
        if self.model.base_acceleration is not None:
            for k in range(1, len(self.base)):
                turn = 1j * k * state.angular_frequency
                table[k] += state.level * turn ** (self.rows[2] - 2.0) * self.base[k] * np.exp(-turn * self.delay)
        return table

    def rates(self, tangents: Sequence[Tangent]) -> Rates:
        """Rates of parameters as this configuration has them, for `slopes` of many states."""
        sensors = self.model.sensors
        gain = [[item.gain.get(sensor.name, 0.0) / (sensor.gain or 1.0) for item in tangents] for sensor in sensors]
        delay = [[item.delay.get(sensor.name, 0.0) for item in tangents] for sensor in sensors]
        return Rates(
            ModelRates.from_parameters(self.balance, [item.free if self.free else item.jointed for item in tangents]),
            np.array(gain).reshape(-1, len(tangents)),
            np.array(delay).reshape(-1, len(tangents)),
            np.array([item.frequency_shift.get(self.configuration, 0.0) for item in tangents]),
        )

    def slopes(
        self,
        state: SteadyState,
        frequency: float,
        names: NDArray[np.str_],
        harmonics: NDArray[np.int64],
        rates: Rates,
    ) -> Complex[NDArray[np.complex128], "k p"]:
        """Derivatives of the result of `read`, shape (k, p)."""
        numbers, order, n_sensor = self.numbers(names), self.rows[2], len(self.model.sensors)
        which, inverse = np.unique(harmonics * n_sensor + numbers, return_inverse=True)
        condensed, contact = self.at(frequency), self.linear.reciprocal.contact(frequency)
        response, balance = self._respond(frequency, which % n_sensor, which // n_sensor), self._at_level(state.level)
        forces = forces_at(balance, state.angular_frequency, state.motion, state.sliders, PARAMETERS)
        values = derivatives(balance, state, forces, rates.system, condensed, contact, response)[inverse]
        if not (rates.gain.any() or rates.delay.any() or rates.frequency_shift.any()):
            return values
        table = self._read(state, forces)
        read, turn = table[harmonics, numbers], 1j * harmonics[:, None] * state.angular_frequency
        late = turn * (rates.delay[numbers] + self.delay[numbers, None] * rates.frequency_shift)
        return np.asarray(
            values + read[:, None] * (rates.gain[numbers] + order[numbers, None] * rates.frequency_shift - late)
        )

    def _respond(self, frequency: float, numbers: NDArray[np.int64], harmonics: NDArray[np.int64]) -> ReadingResponse:
        """Responses of sensors at a frequency, by their numbers and one harmonic each; by reciprocity."""
        motion, force, order = self.rows
        reciprocal = self.linear.reciprocal
        if frequency not in self.by_load:
            along = np.repeat(motion.astype(np.complex128)[:, None, :], self.balance.n_harmonic, axis=1)
            new = [entry for entry in self.linear.frequencies if entry not in self.by_load]
            condensed = [reciprocal.at(entry) for entry in new]
            by_row = reciprocal.balance.structure.displacements_at_each(condensed, along)
            self.by_load.update((entry, np.moveaxis(item, 0, 2)) for entry, item in zip(new, by_row, strict=True))
        [(_, contact)] = self.linear.recover_rows([frequency], motion)
        times = 1j * harmonics * self.at(frequency).angular_frequency
        turned, late = times ** order[numbers], np.exp(-times * self.delay[numbers])[:, None]
        load = turned[:, None] * self.by_load[frequency][harmonics, :, numbers]
        reaction = force[numbers] - turned[:, None] * contact[harmonics, numbers]
        return ReadingResponse(
            harmonics, late * load, late * reaction, late * force[numbers] * self.balance.table.reference
        )

    def numbers(self, names: NDArray[np.str_]) -> NDArray[np.int64]:
        """Indices of sensors by their names."""
        order = {sensor.name: number for number, sensor in enumerate(self.model.sensors)}
        return np.array([order[str(name)] for name in names], dtype=np.int64)

    def _readings(
        self,
        moved: Complex[NDArray[np.complex128], "... h s"],
        forces: Complex[NDArray[np.complex128], "... h d"],
        state: SteadyState,
    ) -> Complex[NDArray[np.complex128], "... h s"]:
        """All sensors' readings of some displacements at them, and joint forces, at the frequency of a state."""
        _, force, order = self.rows
        times = 1j * np.arange(moved.shape[-2])[:, None] * state.angular_frequency
        return self._delay_readings(np.asarray(moved * times**order + forces @ force.T), times)

    def _delay_readings(
        self, readings: Complex[NDArray[np.complex128], "... h s"], times: NDArray[np.complexfloating[Any, Any]]
    ) -> Complex[NDArray[np.complex128], "... h s"]:
        """Readings with the time delays of the sensors."""
        return readings * np.exp(-times * self.delay) if self.delay.any() else readings

    @cached_property
    def delay(self) -> NDArray[np.float64]:
        """Time by which each sensor's reading is late, shape (s,) [s]."""
        return np.array([sensor.delay for sensor in self.model.sensors])

    @cached_property
    def at_rest(self) -> NDArray[np.float64]:
        """Reading of each sensor at rest, from where displacements are reckoned, shape (s,)."""
        return np.array(
            [item.gain * item.at_rest if isinstance(item, LoadCell) else 0.0 for item in self.model.sensors]
        )

    @cached_property
    def rows(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
        """Rows of each sensor over motion and joint forces, with its gain; number of its time derivatives."""
        motion = np.zeros((len(self.model.sensors), self.model.system.n_dof))
        force = np.zeros((len(self.model.sensors), self.balance.n_direction))
        order = np.zeros(len(self.model.sensors), dtype=np.int64)
        for number, sensor in enumerate(self.model.sensors):
            if isinstance(sensor, Sensor):
                motion[number], order[number] = sensor.gain * sensor.row, DERIVATIVE[sensor.quantity]
            elif isinstance(sensor, LoadCell):
                motion[number] = sensor.gain * sensor.row
            else:
                force[number] = sensor.gain * self._line(sensor.line, sensor.component)
        return motion, force, order

    def _at_level(self, level: float) -> HarmonicBalance:
        if level not in self.levels:
            self.levels[level] = self.balance.at_level(level)
        return self.levels[level]

    def _line(self, line: str, component: str) -> Float[NDArray[np.float64], " d"]:
        """Joint directions that a line sensor sums."""
        members = self.model.lines[line]
        row = np.zeros(self.balance.n_direction)
        for number, joint in enumerate(self.model.system.joints):
            if joint.name in members:
                first, last = self.balance.table.direction[number : number + 2]
                row[last - 1 if component == "normal" else first] = 1.0
        return row


def _are_on_one_branch(one: NDArray[np.float64], other: NDArray[np.float64]) -> Bool[NDArray[np.bool_], " n"]:
    """Whether two motions, shape (n, d, nh) each, are known to be of one branch."""
    apart, size = (np.abs(item).max(axis=(1, 2), initial=0.0) for item in (one - other, one))
    return np.asarray(apart <= ONE_BRANCH * size)  # not where a number is missing
