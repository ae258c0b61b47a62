"""One configuration of a tested structure, with or without its contacts: steady states and sensor readings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.model import DERIVATIVE, Model, Sensor
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed, Recovery
from hbsolve.errors import NoSteadyState
from hbsolve.sampling import complex_from_real
from hbsolve.sensitivity import ModelParameter, derivatives
from hbsolve.solution import forces_at, newton_from, solve_at
from hbsolve.state import SteadyState, slider_start
from hbsolve.steady_state import rescue


@dataclass(frozen=True, kw_only=True, eq=False)
class Tangent:
    """Rates of a model with one parameter.

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


@dataclass(frozen=True, kw_only=True, eq=False)
class Configuration:
    """Harmonic balance of one configuration, and the readings of its sensors.

    Parameters
    ----------
    free
        Whether the contacts of all lines are left out.
    model
        As it is in this configuration.
    balance
        Harmonic balance of its system.
    condensed
        The linear structure at the frequencies seen so far, by frequency [Hz].
    recovery
        Recovery of the full response by frequency [Hz], where it saves time.
    levels
        The balance at the levels seen so far, by level [N].
    slider
        Initial positions of the sliders, shape (s,) [m].
    """

    free: bool
    model: Model
    balance: HarmonicBalance
    condensed: dict[float, Condensed]
    recovery: dict[float, Recovery]
    levels: dict[float, HarmonicBalance]
    slider: NDArray[np.float64]

    @classmethod
    def from_model(
        cls, model: Model, free: bool, slider: Callable[[HarmonicBalance], NDArray[np.float64]] | None
    ) -> "Configuration":
        """Configuration of a model, without contacts if it is `free`; `slider` gives initial slider positions [m]."""
        seen = model.free() if free else model
        balance = HarmonicBalance(system=seen.system, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
        start = np.zeros(balance.n_slider) if slider is None or free else slider(balance)
        return cls(free=free, model=seen, balance=balance, condensed={}, recovery={}, levels={}, slider=start)

    def starting(self, slider: Callable[[HarmonicBalance], NDArray[np.float64]] | None) -> "Configuration":
        """The same with other initial sliders; both share the results of the linear structure."""
        return replace(self, slider=np.zeros(self.balance.n_slider) if slider is None else slider(self.balance))

    def at(self, frequency: float) -> Condensed:
        """The linear structure at a frequency, kept for the other levels."""
        if frequency not in self.condensed:
            self.condensed[frequency] = self.balance.at(2 * np.pi * self.true(frequency))
        return self.condensed[frequency]

    def _recovery(self, frequency: float) -> Recovery | None:
        """Recovery of all states at a frequency, where that takes fewer dense solves than state by state."""
        if self.balance.is_dense and frequency not in self.recovery:
            self.recovery[frequency] = self.balance.structure.recovery(self.at(frequency))
        return self.recovery.get(frequency)

    def true(self, frequency: float) -> float:
        """True frequency of the exciter at a labelled one [Hz]."""
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
        guesses: Sequence[SteadyState | None],
    ) -> SteadyState | None:
        """The steady state that is found from the first guess that leads to one; none if there is none to be found."""
        balance, condensed, recovery = self._at_level(level), self.at(frequency), self._recovery(frequency)
        sliders = slider_start(balance, slider)
        shape = (balance.n_harmonic, balance.n_direction)
        starts = [each.motion for each in guesses if each is not None and each.displacement.shape == shape]
        try:
            return solve_at(balance, condensed, starts[0] if starts else None, sliders, recovery)
        except NoSteadyState:
            # Rest and ramps were tried, and would not serve better a second time.
            for start in starts[1:]:
                found = newton_from(balance, condensed, start, sliders, recovery)
                if found is not None:
                    return found
        return rescue(balance, condensed, None, sliders)

    def read(
        self, state: SteadyState, names: NDArray[np.str_], harmonics: NDArray[np.int64]
    ) -> Complex[NDArray[np.complex128], " k"]:
        """Readings of sensors in a state, one harmonic each, shape (k,)."""
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
        gain, order = np.array([sensor.gain or 1.0 for sensor in self.model.sensors]), self._rows[2]
        return np.asarray(values + read[:, None] * ((rates / gain[:, None])[numbers] + order[numbers, None] * shift))

    def _numbers(self, names: NDArray[np.str_]) -> NDArray[np.int64]:
        """Indices of sensors by their names."""
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
        """Rows of each sensor over motion and joint forces, with its gain; number of its time derivatives."""
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
        balance = self._at_level(state.level)
        g = forces_at(balance, state.angular_frequency, state.motion, state.start, want=0).coefficients
        return complex_from_real(g) + balance.table.reference * state.displacement

    def _at_level(self, level: float) -> HarmonicBalance:
        if level not in self.levels:
            self.levels[level] = self.balance.at_level(level)
        return self.levels[level]

    def _line(self, line: str, component: str) -> Float[NDArray[np.float64], " d"]:
        """Which joint directions a line sensor sums."""
        members = self.model.lines[line]
        seen = np.zeros(self.balance.n_direction)
        for number, joint in enumerate(self.model.system.joints):
            if joint.name in members:
                first, last = self.balance.table.direction[number : number + 2]
                seen[last - 1 if component == "normal" else first] = 1.0
        return seen
