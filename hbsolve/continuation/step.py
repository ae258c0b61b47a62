r"""One step of a continuation round folds: how long it is, whether it is taken, and where the branch ends.

The steps themselves are `hbsolve.continuation.arclength`'s. s_x is the amplitude of the vibration at the last point and
s_lambda a share of the range: a step changes the motion of the joints by a share ds of itself, or lambda by that share
of s_lambda, whichever comes first. Over frequency it stops at the resonances of the structure with stuck joints, of
which the joints may feel nothing (`hbsolve.continuation.linear_resonance`).

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
#: A step that takes EASY corrections or fewer grows, one that takes HARD or more shrinks.
EASY, HARD = 3, 6
GROW, SHRINK, RETRY = 1.5, 0.6, 0.35
#: A step across which the tangent turns more than by this cosine, or changes its orientation, is tried shorter, down to
#: the length at which kinks are taken as they come.
TURN, SURE = 0.7, 5e-3
#: The last point lies this near to its prediction, in shares of the step to it; a state further away belongs to another
#: branch, or to this one round a fold.
MAX_PREDICTION_ERROR = 0.5
#: A closed branch has this many points at least, comes back to a point of its own by this share of a step (sheets that
#: lie close together are no closed branch), and runs on in the same direction, by this cosine.
LEAST_LOOP, ASIDE, SAME_WAY = 12, 0.05, 0.9
#: Where the arc cannot be followed, the next state may differ by this much of its size: more is another motion.
FURTHEST_LEAP = 1.0
#: Amplitude that is none, over that of the linear structure at the ends of the range.
LEAST_AMPLITUDE = 1e-6
#: Share of vibration and lambda in a tangent of mean displacement alone. Springs that centre a body leave the square.
UNCHANGED = CENTRING_STIFFNESS**0.5
#: Steps of largest length over the range by default, and points at most.
STEPS, MOST_POINTS = 50, 5000


class Mark(NamedTuple):
    """An earlier point, its tangent, and its number: a branch that comes back to it is closed."""

    point: Direction
    tangent: Direction
    number: int


@dataclass(frozen=True, kw_only=True, eq=False)
class ContinuationState:
    """All that the next step depends on; a continuation goes on from it with the same result."""

    value: float
    """Lambda."""
    motion: Real
    """Real coefficients of the joint directions, shape (d, nh) [m]."""
    slider: Float[Real, " s"]
    by_multiplier: Whole
    """Initial state of the sliders, shape (s,)."""
    tangent: Direction
    """In the direction of travel; before the first step, lambda's way alone."""
    orientation: int
    """Sign of the determinant along it (`hbsolve.continuation.arclength.tangent`); 0 before the first step."""
    step: float
    """The next ds."""
    n_point: int
    """Points so far."""
    mark: Mark
    """Where a closed branch would come back to."""
    leaps: tuple[int, ...] = ()
    """Indices of points on the branch that continuation did not reach from the point before."""
    stop_reason: StopReason | None = None
    """None while there is a next step."""


class Advance(NamedTuple):
    """What a step leads to."""

    point: SteadyState | None
    """The next point; none where the branch has ended before it."""
    state: ContinuationState
    """Where the branch goes on from, or why it does not."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Continuation:
    """A branch from one value of lambda to another.

    Raises
    ------
    BalanceError
        An empty range, a step that is not positive, or what is no real number.
    """

    path: Path
    """What lambda is: `FrequencyPath`, `LevelPath` or `JointPath`."""
    first: float
    last: float
    """Where the branch begins and ends, in either order."""
    step: float | None = None
    """Largest step in lambda, at most the range; a fiftieth of it by default."""
    most_points: int = MOST_POINTS
    """Stop after so many."""
    largest: float = LARGEST
    """Largest ds: share of its size by which the motion may change in a step [-]."""
    _least_amplitude: float = field(init=False, repr=False)
    """Amplitude below which a vibration counts as none: steps would shrink with it for ever [m]."""

    def __post_init__(self) -> None:
        for name in ("first", "last") if self.step is None else ("first", "last", "step"):
            object.__setattr__(self, name, check_real_number(getattr(self, name), name, BalanceError))
        if not np.isfinite([self.first, self.last]).all() or self.first == self.last:
            raise BalanceError(f"the range from {self.first:g} to {self.last:g} is empty: give two different ends")
        # Refuses an end that its path cannot have, before anything is computed.
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
        """Values that no step may pass, and how far each may be missed."""
        return self.path.stops(self.first, self.last)

    def state_at(self, motion: Real, sliders: InitialSliders) -> ContinuationState:
        """Where the branch begins, for a solution at the first value."""
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
                turned = metric.cosine(onward, result.way) < TURN or sign != orientation
                if step <= SURE or not turned:
                    after = self._accept(replace(state, orientation=sign), result, onward, step, metric, sliders)
                    if after is None:
                        continue
                    if step == usual < state.step and after.state.stop_reason is None:
                        # A stop on the way does not limit the next step.
                        after = Advance(after.point, replace(after.state, step=max(after.state.step, state.step)))
                    return after
            step *= RETRY
        return self._leap(state, x, sliders, t.value)

    def _reach(self, value: float, t: Direction) -> float:
        """Length of the step to the next value that no step may pass."""
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
        """To a corrected point, or to the end of the range before it; none where a shorter step must decide."""
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
        """Whether a point lies on the marked way, within a step of the mark, and travels the same way."""
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
        """To the point at the last value; none if there is none near its prediction, as beyond a fold."""
        balance, condensed = self.path.at(self.last)
        try:
            result = solve_at(balance, condensed, predicted, sliders)
        except NoSteadyState:
            return None
        aside = metric.length(Direction(result.motion - predicted, 0.0))
        if aside > max(MAX_PREDICTION_ERROR * step, SURE):
            return None
        after = replace(
            state, value=self.last, motion=result.motion, n_point=state.n_point + 1, stop_reason=StopReason.REACHED
        )
        return Advance(result, after)

    def _leap(self, state: ContinuationState, x: Real, sliders: InitialSliders, t_value: float) -> Advance:
        """Where the arc cannot be followed, the next point at a fixed lambda; a leap if no step would go so far."""
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
        """Lambda where the branch ends, with its unit; empty where it ends as it was asked to."""
        if state.stop_reason in (StopReason.REACHED, StopReason.MOST_POINTS):
            return ""
        return f"{self.path.displayed(state.value):.6g} {self.path.unit}"


def _compute_amplitude(x: Real) -> float:
    """Size of the vibration, or of the displacement where nothing vibrates [m]."""
    vibration = float(np.linalg.norm(x[:, 1:]))
    return vibration or float(np.linalg.norm(x)) or 1.0


def _drifts(t: Direction, metric: Metric) -> bool:
    """Whether a branch goes on by the mean displacement alone, against nothing but the springs that centre a body."""
    return bool(metric.length(Direction(t.motion[:, 1:], t.value)) < UNCHANGED * metric.length(t))


def _point(at: Equation, x: Real, sliders: InitialSliders, iterations: int) -> SteadyState:
    norm = compute_relative_residual(at.balance, at.condensed, x, at.forces, at.residual)
    return recover_state(at.balance, at.condensed, x, sliders, norm, iterations)
