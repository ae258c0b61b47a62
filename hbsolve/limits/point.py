"""Steady states of given sliders at one frequency and level, started from neighbouring states."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from fe.compiled import compiled
from hbsolve.aft import InitialSliders, JointForces, joint_forces
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.errors import NoSteadyState
from hbsolve.joint_law.registry import JACOBIAN
from hbsolve.limits.objective import Measure
from hbsolve.limits.slider_bounds import SliderBox
from hbsolve.limits.sliders import SliderTable, StickIntervals, compute_stick_intervals
from hbsolve.newton import RELATIVE, STALLED, BalancePoint, apply_receptance, imbalance, newton_step
from hbsolve.solution import TOLERANCE, compute_linear_size, forces_at, ramp
from hbsolve.steady_state import FEW_STARTS, from_many_starts, steady_state
from reduction.array_type import Real, Whole

Sliders = Float[Real, " s"]
#: Start motion and sliders of a search.
SearchStart = tuple[Real, Sliders]

#: Largest number of Newton steps, and number of steps between checks of |R|.
LIMIT, CHECK_INTERVAL = 15, 3
#: Largest ratio of |R| to its first value: small if a failure costs little, large if the state is needed [-].
STRICT_RATIO, ANY_RATIO = 0.3, 1e3
#: Number of trials of a Newton step, ratio of their lengths, and the decrease that ends them; the last is always
#: accepted.
TRIALS, SHORTENED, DECREASE = 4, 0.4, 1e-4
#: Largest number of changes of the sliders per state: dragged sliders are moved to their final positions.
ROUNDS = 3
#: A dragged slider is placed inside its interval by this fraction of it, so that round-off cannot drag it again.
INSIDE = 1e-7
#: Homotopy in the sliders: largest number of tries, least step relative to the distance, and factors of the step after
#: a failed and a successful try.
TRIES, LEAST_SHARE, SHORTER, LONGER = 12, 0.02, 0.4, 2.0


@dataclass(frozen=True, kw_only=True, eq=False)
class TrialState:
    """One steady state."""

    motion: Real
    """Motion of the directions, shape (d, nh) [m]."""
    initial_slider: Sliders
    """Slider positions at the first instant, shape (s,) [m]."""
    value: float
    """Value of the objective [its unit]."""
    residual_norm: float
    """|R| relative to the linear motion [-]."""
    forces: JointForces
    """Joint forces in this motion, with their Jacobian."""
    intervals: StickIntervals
    """Intervals in which the sliders stick."""

    @property
    def sticking(self) -> Bool[NDArray[np.bool_], " s"]:
        """Sliders that stick over the whole period, whether dragged before or not."""
        return self.intervals.low <= self.intervals.high

    @property
    def outside_interval(self) -> Bool[NDArray[np.bool_], " s"]:
        """Sticking sliders whose start is outside their interval."""
        return self.sticking & (
            (self.initial_slider < self.intervals.low) | (self.initial_slider > self.intervals.high)
        )

    @property
    def undetermined(self) -> Whole:
        """Sliders that stay at their starts, so that the motion depends on their history."""
        return np.flatnonzero((self.intervals.low < self.intervals.high) & ~self.outside_interval)

    @property
    def periodic_slider(self) -> Sliders:
        """Slider positions at the start of the steady period, shape (s,) [m]."""
        return np.asarray(self.forces.slider[:, -1])


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitPoint:
    """The balance at one frequency and level; see `hbsolve.limits.problem.LimitProblem.at`."""

    balance: HarmonicBalance
    condensed: Condensed
    linear: Real
    measure: Measure
    sliders: SliderTable
    box: SliderBox

    def __post_init__(self) -> None:
        object.__setattr__(self, "scale", compute_linear_size(self.linear))

    scale: float = 0.0

    def trial(self, x: Real, w: Sliders, residual_norm: float) -> TrialState:
        """Trial state of a known steady state."""
        # Copied, since read-only arrays, such as those of a result, have another type in compiled code.
        x, w = np.array(x), np.array(w)
        forces = forces_at(self.balance, self.condensed.angular_frequency, x, _start(w), JACOBIAN)
        intervals = compute_stick_intervals(x, self.sliders, self.balance.sampling.evaluate)
        return self._trial(x, w, residual_norm, forces, intervals)

    def _trial(
        self, x: Real, w: Sliders, residual_norm: float, forces: JointForces, intervals: StickIntervals
    ) -> TrialState:
        value = self.measure.value(self.balance.level, x, forces.coefficients)
        return TrialState(
            motion=x, initial_slider=w, value=value, residual_norm=residual_norm, forces=forces, intervals=intervals
        )

    def solve(self, x: Real, w: Sliders, largest_ratio: float = STRICT_RATIO) -> TrialState | None:
        """Newton's method from a motion nearby; None if it fails."""
        balance, tolerance = self.balance, TOLERANCE * self.scale
        at = BalancePoint(self.linear, self.condensed.angular_frequency, self.condensed.columns, balance.arrays)
        result, norm, forces, intervals = newton_near(
            np.array(x), at, _start(w), self.sliders, tolerance, LIMIT, CHECK_INTERVAL, largest_ratio
        )
        return self._trial(result, w, norm / self.scale, forces, intervals) if norm <= tolerance else None

    def settle(self, x: Real, w: Sliders, largest_ratio: float = ANY_RATIO) -> TrialState | None:
        """As `solve`, with sliders clipped to the box; dragged sliders are then moved to the ends of their intervals.

        Afterwards each slider is undetermined, or slips, or is dragged from a bound of the box.
        """
        trial = self.solve(x, self.box.clip(w), largest_ratio)
        for _ in range(ROUNDS):
            if trial is None or not trial.outside_interval.any():
                break
            margin = INSIDE * (trial.intervals.high - trial.intervals.low)
            ended = np.clip(trial.initial_slider, trial.intervals.low + margin, trial.intervals.high - margin)
            moved = self.box.clip(np.where(trial.outside_interval, ended, trial.initial_slider))
            if np.array_equal(moved, trial.initial_slider):
                break
            trial = self.solve(trial.motion, moved, largest_ratio)
        return trial

    def towards(self, w: Sliders, known: TrialState, tries: int = TRIES) -> TrialState | None:
        """Homotopy from a known state to other sliders; returns the last state reached, or None."""
        share, step, reached = 0.0, 1.0, known
        while share < 1 and tries and step > LEAST_SHARE:
            tries -= 1
            target = min(1.0, share + step)
            trial = self.solve(reached.motion, known.initial_slider + target * (w - known.initial_slider))
            if trial is None:
                step *= SHORTER
            else:
                reached, share, step = trial, target, LONGER * step
        return reached if share > 0 else None

    def from_rest(self, w: Sliders) -> TrialState | None:
        """Newton's method along a ramp of the level."""
        start = _start(w)
        for guess in (self.linear, 0 * self.linear):
            x, norm, _ = ramp(self.balance, self.condensed, guess, start, self.scale)
            if norm <= TOLERANCE * self.scale:
                return self.trial(x, w, norm / self.scale)
        return None

    def from_few_starts(self, w: Sliders) -> TrialState | None:
        """Solution from one of a few starts, for a state that may be missed; None if all fail."""
        state = from_many_starts(self.balance, self.condensed, None, _start(w), FEW_STARTS)
        return None if state is None else self.trial(state.motion, w, state.residual_norm)

    def from_anywhere(self, w: Sliders) -> TrialState | None:
        """Solution by all attempts of `steady_state`; None if all fail."""
        try:
            state = steady_state(self.balance, self.condensed.angular_frequency, slider=w)
        except NoSteadyState:
            return None
        return self.trial(state.motion, w, state.residual_norm)

    def gain(self, value: float, before: float) -> float:
        """Change relative to a value, or to the least reference of the measure."""
        return (value - before) / max(abs(before), self.measure.least)


@compiled
def newton_near(
    x: Any, point: Any, start: Any, sliders: Any, tolerance: float, limit: int, interval: int, largest_ratio: float
) -> Any:
    """Solve R(x) = 0 from x: motion, |R|, joint forces with their Jacobian, and intervals in which the sliders stick.

    Steps in the sliders often leave the branch of a solution, and a search with the full `hbsolve.newton` would spend
    most of its time on states that do not exist. So this stops if |R| is not below `largest_ratio` times its first
    value after `interval` iterations, or the square of this ratio after twice as many.
    """
    linear, omega, columns, arrays = point
    table, first, count, sampling = arrays
    forces = joint_forces(x, omega, table, start, sampling, JACOBIAN)
    R = x - linear + apply_receptance(columns, forces.coefficients)
    norm = np.sqrt((R * R).sum())
    most, iteration = norm, 0
    while norm > tolerance and iteration < limit:
        iteration += 1
        dx = -newton_step(forces, columns, first, count, R, RELATIVE)
        step, new = 1.0, norm
        for trial in range(TRIALS):
            forces = joint_forces(x + step * dx, omega, table, start, sampling, JACOBIAN)
            R = x + step * dx - linear + apply_receptance(columns, forces.coefficients)
            new = np.sqrt((R * R).sum())
            if new < (1.0 - DECREASE * step) * norm or new < tolerance or trial == TRIALS - 1:
                break
            step *= SHORTENED
        x = x + step * dx
        norm = new if new <= STALLED * norm else imbalance(R, columns, x, forces.coefficients)
        if iteration % interval == 0:
            most *= largest_ratio
            if norm > most:
                break
        if not np.isfinite(norm):
            break
    return x, norm, forces, compute_stick_intervals(x, sliders, sampling.evaluate)


def _start(w: Sliders) -> InitialSliders:
    return InitialSliders(np.array(w), np.zeros(len(w), dtype=np.int64))
