"""Path of a stepped sweep through the steady states of a model: each state begins with the sliders of the last one.

One Newton solution per step may leave a branch before it ends. Where a step is wide, smaller steps follow the branch,
and find where it ends: there the sweep jumps.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex
from numpy.typing import NDArray

from correlation.followed_step import FollowedStep, Motion, SweepStep
from correlation.model_solver import ModelSolver
from hbsolve.sampling import complex_from_real
from hbsolve.state import SteadyState
from hbsolve.state_sequence import Track

#: Change of the motion by a step, relative to the larger motion, beyond which the step is wide [-].
WIDE_CHANGE = 0.5
#: Difference from the motion of the linear structure, relative to it, below which there is only one state [-].
NEARLY_LINEAR = 0.1
#: The smallest of the smaller steps, as a share of a step of the sweep [-].
LEAST_STEP = 1 / 64
#: States of two sweeps are the same if their motions differ by less, relative [-]; Newton's method ends at 1e-9.
SAME_MOTION = 1e-6


class JumpPoint(NamedTuple):
    """Point of a sweep at which it jumps to another branch."""

    frequency: float
    """Middle of the smallest step that still jumps [Hz]."""
    falls: bool
    """Whether the amplitude falls along the sweep."""


@dataclass(eq=False)
class SweepPath:
    """Sweeps over the same frequencies of one level, one after another.

    Parameters
    ----------
    solver
        Solver of the configuration.
    level
        Level of the drive [its unit].
    followed
        Steps that were followed for a model nearby; brought up to date.
    """

    solver: ModelSolver
    level: float
    followed: dict[SweepStep, FollowedStep] = field(default_factory=dict)
    _sliders: NDArray[np.float64] = field(init=False)
    _first_sweep: dict[float, SteadyState] = field(init=False, default_factory=dict)
    _jumps: set[frozenset[float | None]] = field(init=False, default_factory=set)

    def __post_init__(self) -> None:
        self._sliders = self.solver.slider

    def follow(
        self,
        frequencies: Sequence[float],
        newton_states: Sequence[SteadyState | None],
        wide: Bool[NDArray[np.bool_], " s"],
    ) -> tuple[list[SteadyState | None], list[JumpPoint]]:
        """Steady states along one sweep, in its order, and the points where it jumps.

        Parameters
        ----------
        frequencies
            Frequencies of the sweep, the same in all sweeps [Hz].
        newton_states
            States by one Newton solution per step, each from the one before; they are taken where the path leads
            through them.
        wide
            Whether each step between these is wide, as `find_wide_steps` says.
        """
        states: list[SteadyState | None] = [None] * len(frequencies)
        jumps: list[JumpPoint] = []
        last: int | None = None
        for number, frequency in enumerate(frequencies):
            first = self._first_sweep.get(frequency)
            before = None if last is None else frequencies[last]
            here = None if last is None else states[last]
            known, at = newton_states[number], None if number == 0 else newton_states[number - 1]
            if first is not None and self._follows_first_sweep(here, before, frequency, first):
                state: SteadyState | None = first
            else:
                leads = self._passes_through(here, at, known)
                if leads and here is not None and not wide[number - 1]:
                    state, jump = known, None
                else:
                    state, jump = self._next(here, before, frequency, known if leads else None)
                if jump is not None:
                    jumps.append(jump)
                    self._jumps.add(frozenset((frequency, before)))
                if first is not None and is_same(first, state):
                    state = first
            if state is None:
                continue
            if known is not None and state is not first and is_same(known, state):
                state = known
            states[number], last = state, number
            self._sliders = state.periodic_slider
        for frequency, state in zip(frequencies, states, strict=True):
            if state is not None:
                self._first_sweep.setdefault(frequency, state)
        return states, jumps

    def _passes_through(
        self, here: SteadyState | None, last: SteadyState | None, newton_state: SteadyState | None
    ) -> bool:
        """Whether the path leads through a state that was found: at the one found before, with the same sliders."""
        return (
            newton_state is not None
            and (here is None or here is last)
            and np.array_equal(newton_state.initial_slider, self._sliders)
        )

    def _follows_first_sweep(
        self, here: SteadyState | None, before: float | None, frequency: float, first: SteadyState
    ) -> bool:
        """Whether the state is that of the first sweep: its sliders are the same, and no jump lies in between."""
        if not np.array_equal(first.initial_slider, self._sliders):
            return False
        if before is None:
            return True
        return here is self._first_sweep.get(before) and frozenset((frequency, before)) not in self._jumps

    def _next(
        self, here: SteadyState | None, before: float | None, target: float, newton_state: SteadyState | None
    ) -> tuple[SteadyState | None, JumpPoint | None]:
        """State after the last one and the jump to it, if any; `newton_state` is by one Newton solution, if known."""
        state = self.solver.solve(self.level, target, self._sliders, [here]) if newton_state is None else newton_state
        if here is None or before is None or state is None:
            return state, None
        if not self._may_jump(here.displacement, before, state.displacement, target):
            return state, None
        step = SweepStep(self.level, before, target)
        earlier = self.followed.get(step)
        if earlier is not None and earlier.jump is None and earlier.is_near(here.displacement, state.displacement):
            return state, None
        expected = None if earlier is None else earlier.jump
        state, jump = self._follow_in_small_steps(here, before, state, target, expected)
        share = None if jump is None else (jump.frequency - before) / (target - before)
        self.followed[step] = FollowedStep(here.displacement.copy(), state.displacement.copy(), share)
        return state, jump

    def _follow_in_small_steps(
        self, here: SteadyState, frequency: float, there: SteadyState, target: float, expected: float | None
    ) -> tuple[SteadyState, JumpPoint | None]:
        """Follow the branch in small steps.

        `there` is the state by one Newton solution, `expected` the share of the step at which a jump is expected, if
        any: the first of the small steps ends short of it.
        """
        motion, share, jump = here.displacement, 0.0, None
        step = 0.5 if expected is None else max(expected - LEAST_STEP, LEAST_STEP)
        while True:
            to = min(share + step, 1.0)
            ends = [frequency + item * (target - frequency) if item < 1 else target for item in (share, to)]
            track = self.solver.follow_near(self.level, ends[1], self._sliders, motion)
            following = complex_from_real(track.motion[0]) if np.isfinite(track.norm[0]) else None
            wide = following is None or self._may_jump(motion, ends[0], following, ends[1])
            if wide and to - share > LEAST_STEP:
                step = (to - share) / 2
                continue
            if following is None:
                # The branch ends and no other is near: the sweep jumps to the state by one Newton solution.
                return there, JumpPoint(
                    (ends[0] + ends[1]) / 2, _compute_size(there.displacement) < _compute_size(motion)
                )
            if wide:
                jump = JumpPoint((ends[0] + ends[1]) / 2, _compute_size(following) < _compute_size(motion))
            step = 2 * (to - share if share or expected is None else LEAST_STEP)
            motion, share = following, to
            if share == 1:
                state = self.solver.states(self.level, [target], track)[0]
                assert state is not None
                return state, jump

    def _may_jump(self, here: Motion, frequency: float, there: Motion, target: float) -> bool:
        """Whether a step is wide: the branch may have ended between its motions."""
        motion = np.array([here[1:], there[1:]])
        linear = np.array(
            [self.solver.forced(self.level, at) * self.solver.at(at).dynamic[1:] for at in (frequency, target)],
            dtype=complex,
        )
        return bool(_are_wide(motion, linear)[0])


def find_wide_steps(
    solver: ModelSolver, level: float, frequencies: Sequence[float], track: Track
) -> Bool[NDArray[np.bool_], " s"]:
    """Whether each step between two states of n is wide, so that a branch may have ended in it, shape (n - 1,).

    Parameters
    ----------
    solver, level, frequencies, track
        As `ModelSolver.follow` takes and returns them.
    """
    if not track.motion.size:
        return np.zeros(max(len(frequencies) - 1, 0), dtype=bool)
    linear = np.array(
        [solver.forced(level, frequency) * solver.at(frequency).dynamic[1:] for frequency in frequencies], dtype=complex
    )
    motion = complex_from_real(track.motion)[:, 1:]
    return _are_wide(motion, linear)


def _are_wide(
    motion: Complex[NDArray[np.complex128], "n h d"], linear: Complex[NDArray[np.complex128], "n h d"]
) -> Bool[NDArray[np.bool_], " s"]:
    """Whether each step is wide, shape (n - 1,): its motions are far apart, and one of them is far from linear."""
    axes = (1, 2)
    apart, size = np.abs(np.diff(motion, axis=0)).max(axes, initial=0.0), np.abs(motion).max(axes, initial=0.0)
    bent = np.abs(motion - linear).max(axes, initial=0.0) > NEARLY_LINEAR * np.abs(linear).max(axes, initial=0.0)
    return np.asarray((apart > WIDE_CHANGE * np.maximum(size[1:], size[:-1])) & (bent[1:] | bent[:-1]))


def is_same(first: SteadyState | None, state: SteadyState | None) -> bool:
    """Whether two states are the same: their initial sliders are equal, their motions to less than `SAME_MOTION`."""
    if first is None or state is None:
        return first is state
    if not np.array_equal(first.initial_slider, state.initial_slider):
        return False
    apart = np.abs(first.displacement - state.displacement).max(initial=0.0)
    return bool(apart <= SAME_MOTION * np.abs(first.displacement).max(initial=0.0))


def _compute_size(motion: Motion) -> float:
    """Largest amplitude of a joint direction in any harmonic [m]."""
    return float(np.abs(motion[1:]).max(initial=0.0))
