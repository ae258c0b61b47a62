r"""One step of a continuation round folds: how long it is, whether it is taken, and where the branch ends.

The steps themselves are in `hbsolve.continuation.arclength`. s_x is the amplitude of the vibration at the last point
and s_lambda a fraction of the range: a step changes the motion of the joints by a fraction ds of its size, or lambda by
that fraction of s_lambda, whichever comes first. Over frequency it stops at the resonances of the structure with stuck
joints, in which the joints may not move (`hbsolve.continuation.linear_resonance`).

References
----------
Seydel, Practical Bifurcation and Stability Analysis (2010), section 4.5: scaling and step control.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hbsolve.aft import InitialSliders
from hbsolve.condensed import CENTRING_STIFFNESS
from hbsolve.continuation.arclength import Corrected, Direction, Metric, correct_points, tangent
from hbsolve.continuation.continuation_parameter import Equation, Path, equation
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import BalanceError, NoSteadyState
from hbsolve.solution import compute_relative_residual, recover_state, solve_at
from hbsolve.state import SteadyState
from reduction.array_input import check_real_number
from reduction.array_type import Real, Whole

#: Largest, first and smallest ds.
LARGEST, FIRST, LEAST = 0.2, 0.05, 1e-7
#: A step that takes EASY corrections or fewer grows, and a step that takes HARD or more shrinks.
EASY, HARD = 3, 6
GROW, SHRINK, RETRY = 1.5, 0.6, 0.35
#: A step across which the tangent turns more than by this cosine, or changes its orientation, is shortened, down to the
#: length at which any kink is accepted.
MIN_TANGENT_COSINE, KINK_STEP = 0.7, 5e-3
#: Largest distance of the last point from its prediction, relative to the step; a state further away belongs to another
#: branch, or to this branch beyond a fold.
MAX_PREDICTION_ERROR = 0.5
#: Closed branch: least number of points, largest distance from the tangent at an earlier point, relative to a step
#: (sheets close to each other are not a closed branch), and least cosine between both directions.
LEAST_LOOP, ASIDE, SAME_WAY = 12, 0.05, 0.9
#: Largest relative change to the next state where the arc cannot be followed: a larger one is another motion.
FURTHEST_LEAP = 1.0
#: Amplitude that counts as zero, over that of the linear structure at the ends of the range.
LEAST_AMPLITUDE = 1e-6
#: Fraction of vibration and lambda in a tangent of mean displacement alone: the centring springs leave its square.
UNCHANGED = CENTRING_STIFFNESS**0.5
#: Default number of largest steps over the range, and largest number of points.
STEPS, MOST_POINTS = 50, 5000


class Mark(NamedTuple):
    """An earlier point, its tangent, and its number: a branch that returns to it is closed."""

    point: Direction
    tangent: Direction
    number: int


@dataclass(frozen=True, kw_only=True, eq=False)
class ContinuationState:
    """State of a continuation, which determines all further steps."""

    value: float
    """Lambda."""
    motion: Real
    """Real coefficients of the joint directions, shape (d, nh) [m]."""
    slider: Float[Real, " s"]
    by_multiplier: Whole
    """Initial state of the sliders, shape (s,)."""
    tangent: Direction
    """Tangent in the direction of travel; before the first step, the direction of lambda alone."""
    orientation: int
    """Sign of the determinant along it (`hbsolve.continuation.arclength.tangent`); 0 before the first step."""
    step: float
    """Next ds."""
    n_point: int
    """Number of points so far."""
    mark: Mark
    """Point to which a closed branch would return."""
    leaps: tuple[int, ...] = ()
    """Indices of points on the branch that continuation did not reach from the point before."""
    stop_reason: StopReason | None = None
    """None while there is a next step."""


class Advance(NamedTuple):
    """Result of a step."""

    point: SteadyState | None
    """The next point; None if the branch ended before it."""
    state: ContinuationState
    """State from which the branch continues, or with the reason why it ends."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Continuation:
    """A branch from one value of lambda to another.

    Raises
    ------
    BalanceError
        An empty range, a step that is not positive, or a value that is not a real number.
    """

    path: Path
    """Meaning of lambda: `FrequencyPath`, `LevelPath`, `JointPath` or `ControlledAmplitude`."""
    first: float
    last: float
    """Values of lambda where the branch begins and ends, in either order."""
    step: float | None = None
    """Largest step in lambda, at most the range; a fiftieth of the range by default."""
    most_points: int = MOST_POINTS
    """Largest number of points."""
    largest: float = LARGEST
    """Largest ds: relative change of the motion in a step [-]."""
    _least_amplitude: float = field(init=False, repr=False)
    """Amplitude below which a vibration counts as zero: steps would shrink with it without end [m]."""

    def __post_init__(self) -> None:
        for name in ("first", "last") if self.step is None else ("first", "last", "step"):
            object.__setattr__(self, name, check_real_number(getattr(self, name), name, BalanceError))
        if not np.isfinite([self.first, self.last]).all() or self.first == self.last:
            raise BalanceError(f"the range from {self.first:g} to {self.last:g} is empty: give two different ends")
        # Refuses an end that the path cannot have, before any step.
        ends = [self.path.at(end) for end in (self.first, self.last)]
        amplitude = max(_compute_amplitude(balance.linear(condensed)) for balance, condensed in ends)
        object.__setattr__(self, "_least_amplitude", LEAST_AMPLITUDE * amplitude)
        if self.step is not None and not 0 < self.step < np.inf:
            raise BalanceError(f"step = {self.step:g} must be positive and finite")

    @property
    def _scale(self) -> float:
        """s_lambda."""
        way = abs(self.last - self.first)
        return (way / STEPS if self.step is None else min(self.step, way)) / self.largest

    @cached_property
    def _stops(self) -> tuple[Real, Real]:
        """Values at which a step must stop, and the tolerance of each."""
        return self.path.stops(self.first, self.last)

    def state_at(self, motion: Real, sliders: InitialSliders) -> ContinuationState:
        """State at the beginning of the branch, for a solution at the first value."""
        rest = np.zeros_like(motion)
        return ContinuationState(
            value=self.first,
            motion=motion,
            slider=sliders.value,
            by_multiplier=sliders.by_multiplier,
            tangent=Direction(rest, float(np.sign(self.last - self.first)) * self._scale),
            orientation=0,
            step=FIRST,
            n_point=1,
            mark=Mark(Direction(motion, self.first), Direction(rest, 0.0), 1),
        )

    def advance(self, state: ContinuationState) -> Advance:
        """The next point, or the end of the branch."""
        sliders = InitialSliders(np.array(state.slider), np.array(state.by_multiplier))
        x, value = np.array(state.motion), state.value
        metric = Metric(max(_compute_amplitude(x), self._least_amplitude), self._scale)
        t, orientation = self._set_out(state, metric, sliders)
        step = usual = min(state.step, self._reach(value, t))
        while step >= LEAST:
            if self._ends(value, t, step):
                ahead = (self.last - value) / t.value
                ended = self._finish(state, x + ahead * t.motion, ahead, metric, sliders)
                if ended is not None:
                    return ended
            for result in correct_points(self.path, x, value, t, step, metric, sliders, orientation):
                onward, sign = tangent(result.at, result.way, metric, orientation)
                turned = metric.cosine(onward, result.way) < MIN_TANGENT_COSINE or sign != orientation
                if step <= KINK_STEP or not turned:
                    after = self._accept(replace(state, orientation=sign), result, onward, step, metric, sliders)
                    if after is None:
                        continue
                    if step == usual < state.step and after.state.stop_reason is None:
                        # A stop does not limit the next step.
                        after = Advance(after.point, replace(after.state, step=max(after.state.step, state.step)))
                    return after
            step *= RETRY
        return self._leap(state, x, sliders, t.value)

    def _reach(self, value: float, t: Direction) -> float:
        """Length of the step to the next value at which a step must stop."""
        stops, margin = self._stops
        ahead = (stops - value) * np.sign(t.value)
        ahead = ahead[ahead > margin]
        return max(float(ahead.min() / abs(t.value)), LEAST) if ahead.size and t.value else np.inf

    def _set_out(self, state: ContinuationState, metric: Metric, sliders: InitialSliders) -> tuple[Direction, int]:
        """Tangent at the last point, of length 1, and its orientation."""
        t = Direction(np.array(state.tangent.motion), state.tangent.value)
        if not state.orientation:
            here = equation(self.path, state.value, np.array(state.motion), sliders)
            return tangent(here, t, metric, 0)
        length = metric.length(t)
        return Direction(t.motion / length, t.value / length), state.orientation

    def _accept(
        self,
        state: ContinuationState,
        result: Corrected,
        t: Direction,
        step: float,
        metric: Metric,
        sliders: InitialSliders,
    ) -> Advance | None:
        """Go to a corrected point, or to the end of the range before it; None if a shorter step is needed."""
        if (result.value - self.last) * (self.last - self.first) > 0:
            share = (self.last - state.value) / (result.value - state.value)
            between = state.motion + share * (result.motion - state.motion)
            return self._finish(state, between, share * step, metric, sliders)
        if self._outside(result.value):
            return Advance(None, replace(state, value=result.value, stop_reason=StopReason.TURNED_BACK))
        if result.at.balance.structure.is_centred and _drifts(t, metric):
            return Advance(None, replace(state, value=result.value, stop_reason=StopReason.DRIFTED))
        try:
            point = _point(result.at, result.motion, sliders, result.iterations)
        except NoSteadyState:
            return Advance(None, replace(state, value=result.value, stop_reason=StopReason.UNSETTLED))
        n_point = state.n_point + 1
        if self._closed(state, result, t, step, metric):
            return Advance(point, replace(state, value=result.value, n_point=n_point, stop_reason=StopReason.CLOSED))
        if n_point >= 2 * state.mark.number:
            state = replace(state, mark=Mark(Direction(result.motion, result.value), t, n_point))
        grow = GROW if result.iterations <= EASY else SHRINK if result.iterations >= HARD else 1.0
        after = replace(
            state,
            value=result.value,
            motion=result.motion,
            tangent=t,
            step=min(grow * step, self.largest),
            n_point=n_point,
            stop_reason=None if n_point < self.most_points else StopReason.MOST_POINTS,
        )
        return Advance(point, after)

    def _closed(self, state: ContinuationState, result: Corrected, t: Direction, step: float, metric: Metric) -> bool:
        """Whether a point lies on the tangent at the mark, within a step, with the same direction of travel."""
        (motion, value), marked, number = state.mark
        away = Direction(result.motion - motion, result.value - value)
        along = metric.dot(away, marked) / (metric.length(marked) or 1.0)
        aside = np.sqrt(max(metric.dot(away, away) - along**2, 0.0))
        near = abs(along) <= step and aside <= ASIDE * step
        return bool(near and metric.cosine(t, marked) >= SAME_WAY and state.n_point >= number + LEAST_LOOP)

    def _ends(self, value: float, t: Direction, step: float) -> bool:
        """Whether the prediction of the step reaches the last value."""
        ahead, reach = self.last - value, step * t.value
        return bool(reach and 0 <= ahead / reach <= 1)

    def _finish(
        self, state: ContinuationState, predicted: Real, step: float, metric: Metric, sliders: InitialSliders
    ) -> Advance | None:
        """Go to the point at the last value; None if there is none near its prediction, such as beyond a fold."""
        balance, condensed = self.path.at(self.last)
        try:
            result = solve_at(balance, condensed, predicted, sliders)
        except NoSteadyState:
            return None
        aside = metric.length(Direction(result.motion - predicted, 0.0))
        if aside > max(MAX_PREDICTION_ERROR * step, KINK_STEP):
            return None
        after = replace(
            state, value=self.last, motion=result.motion, n_point=state.n_point + 1, stop_reason=StopReason.REACHED
        )
        return Advance(result, after)

    def _leap(self, state: ContinuationState, x: Real, sliders: InitialSliders, t_value: float) -> Advance:
        """The next point at a fixed lambda, where the arc cannot be followed; a leap if it is further than a step."""
        towards = np.sign(t_value or self.last - self.first)
        for share in (0.1, 0.5, 0.01):
            value = state.value + float(towards) * share * self.largest * self._scale
            if self._outside(value) or (self.last - value) * (self.last - self.first) < 0:
                continue
            balance, condensed = self.path.at(value)
            try:
                result = solve_at(balance, condensed, x, sliders)
            except NoSteadyState:
                continue
            jump = np.linalg.norm(result.motion - x) / _compute_amplitude(x)
            if jump > FURTHEST_LEAP:
                continue
            after = replace(
                state,
                value=value,
                motion=result.motion,
                tangent=Direction(np.zeros_like(x), float(towards) * self._scale),
                orientation=0,
                step=FIRST,
                n_point=state.n_point + 1,
                leaps=(*state.leaps, state.n_point) if jump > self.largest else state.leaps,
            )
            return Advance(result, after)
        return Advance(None, replace(state, stop_reason=StopReason.FAILED))

    def _outside(self, value: float) -> bool:
        return (value - self.first) * (self.last - self.first) < 0

    def stopped_at(self, state: ContinuationState) -> str:
        """Lambda where the branch ends, with its unit; empty at the last value or the largest number of points."""
        if state.stop_reason in (StopReason.REACHED, StopReason.MOST_POINTS):
            return ""
        return f"{self.path.displayed(state.value):.6g} {self.path.unit}"


def _compute_amplitude(x: Real) -> float:
    """Size of the vibration, or of the displacement if there is no vibration [m]."""
    vibration = float(np.linalg.norm(x[:, 1:]))
    return vibration or float(np.linalg.norm(x)) or 1.0


def _drifts(t: Direction, metric: Metric) -> bool:
    """Whether only the mean displacement of a body changes along a branch, against its centring springs."""
    return bool(metric.length(Direction(t.motion[:, 1:], t.value)) < UNCHANGED * metric.length(t))


def _point(at: Equation, x: Real, sliders: InitialSliders, iterations: int) -> SteadyState:
    norm = compute_relative_residual(at.balance, at.condensed, x, at.forces, at.residual)
    return recover_state(at.balance, at.condensed, x, sliders, norm, iterations)
