"""What a test model predicts at the points of a campaign, and how that changes with the model.

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

from correlation.test_model import DERIVATIVE, Sensor, TestModel
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.sampling import complex_from_real
from hbsolve.sensitivity import ModelParameter, derivatives
from hbsolve.state import slider_start
from hbsolve.steady_state import NoConvergence, SteadyState, forces_at, solve_at, steady_state


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """Where something is measured: k rows, each one harmonic of one sensor at one level and frequency.

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

    def __len__(self) -> int:
        return len(self.level)

    def where(self, chosen: NDArray[np.bool_]) -> "Points":
        """Some of the rows."""
        return Points(
            free=self.free[chosen],
            level=self.level[chosen],
            frequency=self.frequency[chosen],
            sensor=self.sensor[chosen],
            harmonic=self.harmonic[chosen],
        )


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
    """

    points: Points
    value: Complex[NDArray[np.complex128], " k"]
    states: Mapping[Key, SteadyState]
    others: Mapping[Key, SteadyState] = field(default_factory=dict)


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
    """

    points: Points
    slider: Callable[[HarmonicBalance], NDArray[np.float64]] | None = None
    sweeps: tuple[int, ...] = ()

    def predict(self, model: TestModel, before: Prediction | None = None) -> Prediction:
        """Solve for all points.

        Parameters
        ----------
        model
            What is tested.
        before
            A prediction for a model nearby.
        """
        value = np.full(len(self.points), np.nan, dtype=np.complex128)
        both: tuple[dict[Key, SteadyState], dict[Key, SteadyState]] = ({}, {})
        known = ({}, {}) if before is None else (before.states, before.others)
        for free, levels in self._configurations:
            solver = _Configuration.of(model, free, self.slider)
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
                            state = solver.solve(level, frequency, sliders, start, neighbour)
                        if state is None:
                            continue
                        neighbour = both[number][key] = state
                        sliders = state.slider_at_start if self.sweeps else sliders
                        read = solver.read(state, self.points.sensor[rows], self.points.harmonic[rows])
                        value[rows] = read if number == 0 else (value[rows] + read) / 2
        return Prediction(points=self.points, value=value, states=both[0], others=both[1])

    def derivatives(
        self, model: TestModel, prediction: Prediction, tangents: Sequence["Tangent"]
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
            solver = _Configuration.of(model, free, self.slider)
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Tangent:
    """How a model's data change with one parameter.

    Parameters
    ----------
    jointed, free
        Rates of the structure's data in either configuration.
    gain
        Rate of each sensor's gain, by its name.
    shift
        Relative rate of the true frequency, by configuration, as far as velocities and accelerations are read with it;
        what it does to the structure is among the rates of the data.
    """

    jointed: ModelParameter
    free: ModelParameter
    gain: Mapping[str, float]
    shift: Mapping[str, float] = field(default_factory=dict)


def _alike(state: SteadyState, other: SteadyState) -> bool:
    """Whether both sweeps move alike, so that their derivatives do; static forces may differ."""
    apart = np.abs(state.displacement[1:] - other.displacement[1:]).max(initial=0.0)
    return bool(apart < ALIKE * np.abs(state.displacement[1:]).max(initial=0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Configuration:
    """The balance of one configuration, and what its sensors read."""

    free: bool
    model: TestModel
    balance: HarmonicBalance
    condensed: dict[float, Condensed]
    slider: NDArray[np.float64]

    @classmethod
    def of(
        cls, model: TestModel, free: bool, slider: Callable[[HarmonicBalance], NDArray[np.float64]] | None
    ) -> "_Configuration":
        seen = model.free() if free else model
        balance = HarmonicBalance(system=seen.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
        start = np.zeros(balance.n_slider) if slider is None or free else slider(balance)
        return cls(free=free, model=seen, balance=balance, condensed={}, slider=start)

    def at(self, frequency: float) -> Condensed:
        """The linear structure at a frequency, kept for the other levels."""
        if frequency not in self.condensed:
            self.condensed[frequency] = self.balance.at(2 * np.pi * self.true(frequency))
        return self.condensed[frequency]

    def true(self, frequency: float) -> float:
        """What the exciter does where its label says `frequency` [Hz]."""
        return frequency * (1 + self.model.shift.get(self.configuration, 0.0))

    @property
    def configuration(self) -> str:
        """Its name."""
        return "free" if self.free else "jointed"

    def solve(
        self,
        level: float,
        frequency: float,
        slider: NDArray[np.float64],
        start: SteadyState | None,
        neighbour: SteadyState | None,
    ) -> SteadyState | None:
        """The steady state; none if there is none to be found."""
        balance, condensed = self.balance.at_level(level), self.at(frequency)
        sliders = slider_start(balance, slider, False)
        for guess in (start, neighbour):
            if guess is None or guess.displacement.shape != (balance.n_harmonic, balance.n_direction):
                continue
            try:
                return solve_at(balance, condensed, guess.motion, sliders)
            except NoConvergence:
                continue
        try:
            return steady_state(balance, 2 * np.pi * self.true(frequency), slider=slider)
        except NoConvergence:
            return None

    def read(
        self, state: SteadyState, names: NDArray[np.str_], harmonics: NDArray[np.int64]
    ) -> Complex[NDArray[np.complex128], " k"]:
        """What sensors read of a state, one harmonic each."""
        table = self._readings(state.coefficients, self._forces(state), state)
        return np.asarray(table[harmonics, self._numbers(names)])

    def slopes(
        self,
        state: SteadyState,
        condensed: Condensed,
        names: NDArray[np.str_],
        harmonics: NDArray[np.int64],
        tangents: Sequence[Tangent],
    ) -> Complex[NDArray[np.complex128], "k p"]:
        """Their derivatives."""
        changes = [tangent.free if self.free else tangent.jointed for tangent in tangents]
        found = derivatives(self.balance, state, changes, condensed)
        numbers, read = self._numbers(names), self.read(state, names, harmonics)
        values = self._readings(found.coefficients, found.force, state)[:, harmonics, numbers].T
        shift = np.array([tangent.shift.get(self.configuration, 0.0) for tangent in tangents])
        rates = np.array(
            [[tangent.gain.get(sensor.name, 0.0) for tangent in tangents] for sensor in self.model.sensors]
        )
        gain = np.array([sensor.gain or 1.0 for sensor in self.model.sensors])
        order = np.array([DERIVATIVE[each.quantity] if isinstance(each, Sensor) else 0 for each in self.model.sensors])
        return np.asarray(values + read[:, None] * ((rates / gain[:, None])[numbers] + order[numbers, None] * shift))

    def _numbers(self, names: NDArray[np.str_]) -> NDArray[np.int64]:
        """Which sensors they are."""
        order = {sensor.name: number for number, sensor in enumerate(self.model.sensors)}
        return np.array([order[str(name)] for name in names], dtype=np.int64)

    def _readings(
        self,
        coefficients: Complex[NDArray[np.complex128], "... h r"],
        forces: Complex[NDArray[np.complex128], "... h d"],
        state: SteadyState,
    ) -> Complex[NDArray[np.complex128], "... h s"]:
        """All sensors' readings of some motions and joint forces at the frequency of a state."""
        motion, force, order = self._rows
        times = 1j * np.arange(coefficients.shape[-2])[:, None] * state.angular_frequency
        return np.asarray((coefficients @ motion.T) * times**order + forces @ force.T)

    @cached_property
    def _rows(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
        """Of each sensor what it follows of the motion and of the joint forces, gains included; time derivatives."""
        motion = np.zeros((len(self.model.sensors), self.model.system.n_dof))
        force = np.zeros((len(self.model.sensors), self.balance.n_direction))
        order = np.zeros(len(self.model.sensors), dtype=np.int64)
        for number, sensor in enumerate(self.model.sensors):
            if isinstance(sensor, Sensor):
                motion[number], order[number] = sensor.gain * sensor.row, DERIVATIVE[sensor.quantity]
            else:
                force[number] = sensor.gain * self._line(sensor.line, sensor.component)
        return motion, force, order

    def _forces(self, state: SteadyState) -> Complex[NDArray[np.complex128], "harmonic d"]:
        """Coefficients of all joint forces f = g + D x."""
        balance = self.balance.at_level(state.level)
        g = forces_at(balance, state.angular_frequency, state.motion, state.start, want=0).coefficients
        return complex_from_real(g) + balance.table.reference * state.displacement

    def _line(self, line: str, component: str) -> Float[NDArray[np.float64], " d"]:
        """Which joint directions a line sensor sums."""
        members = self.model.lines[line]
        seen = np.zeros(self.balance.n_direction)
        for number, joint in enumerate(self.model.system.joints):
            if joint.name in members:
                first, last = self.balance.table.direction[number : number + 2]
                seen[last - 1 if component == "normal" else first] = 1.0
        return seen
