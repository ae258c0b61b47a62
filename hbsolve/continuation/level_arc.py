"""An arc over the level at one frequency, round its folds: states at the level of a balance, and where it turns."""

from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.arclength import Direction, Metric, correct_in_plane
from hbsolve.continuation.continuation_parameter import LevelPath
from hbsolve.continuation.step import Continuation, ContinuationState
from hbsolve.errors import Failure, NoSteadyState
from hbsolve.solution import newton_from, solve_at
from hbsolve.state import SteadyState
from reduction.array_type import Real

#: First and last level of the arc and its largest step, relative to the level of the balance; largest number of points.
FIRST, LAST, STEP, MOST_POINTS = 0.3, 10.0, 2.0, 100
#: Largest and first relative change of the motion in a step: the arc only serves to find states and is not shown.
LARGEST, SET_OUT = 0.4, 0.2
#: Largest relative change of the motion in a step where the arc turns near the wanted level, and the distance that
#: counts as near, relative to the level.
FINE, CLOSE = 0.06, 0.6
#: Distance of a state from the line between two points, relative to its length, up to which the state lies on the arc;
#: for other states, accuracy of the place on the line at which the arc passes the level.
NEAR, LOCATED = 0.2, 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class LevelArc:
    """States of one frequency that are connected over the level."""

    level: float
    """Level of the balance [-]."""
    states: tuple[SteadyState, ...]
    """States at that level, in the order of the arc."""
    highest: tuple[float, ...]
    """Levels at which the arc turns from rising to falling sizes of the level [-]."""
    lowest: tuple[float, ...]
    """Levels at which it turns back from falling to rising sizes [-]."""
    n_point: int
    """Number of points of the arc [-]."""

    @property
    def missed(self) -> float:
        """Distance of the nearest fold that misses the level, relative to the level; inf if there is none.

        Between a fold at a highest level and the fold before or after it at a lowest level there are three states. If
        both are below or both above the level of the balance, two of them are missed.
        """
        above = [item / self.level - 1 for item in self.lowest]
        below = [1 - item / self.level for item in self.highest]
        return min((item for item in above + below if item > 0), default=np.inf)


def follow_level(balance: HarmonicBalance, angular_frequency: float, sliders: InitialSliders) -> LevelArc:
    """Follow the response over the level, from a low level to well beyond that of the balance.

    Parameters
    ----------
    balance
        Balance with the level whose states are wanted, not 0.
    angular_frequency
        Omega [rad/s].
    sliders
        Sliders at the first instant.
    """
    path = LevelPath(balance=balance, angular_frequency=angular_frequency)
    arc = _make_arc(path, balance.level, LARGEST)
    at, condensed = path.at(arc.first)
    try:
        state = arc.state_at(solve_at(at, condensed, None, sliders).motion, sliders)
    except NoSteadyState:
        return LevelArc(level=balance.level, states=(), highest=(), lowest=(), n_point=0)
    points = [replace(state, step=SET_OUT)]
    states: list[SteadyState] = []
    turns: list[float] = []
    while points[-1].stop_reason is None:
        points.append(arc.advance(points[-1])[1])
        states += _find_passed(path, balance.level, points[-2], points[-1], sliders)
        if len(points) > 2 and _turns(*points[-3:]):
            near, turn = _turn(path, balance.level, points[-3:], sliders)
            states += near
            turns.append(turn)
    # The first turn ends a rise, since the arc begins with one; then the turns alternate.
    return LevelArc(
        level=balance.level, states=tuple(states), highest=tuple(turns[::2]), lowest=tuple(turns[1::2]),
        n_point=len(points),
    )  # fmt: skip


def _make_arc(path: LevelPath, level: float, largest: float) -> Continuation:
    # The scale of the level, step / largest, is the same for all arcs.
    return Continuation(
        path=path, first=FIRST * level, last=LAST * level, step=STEP * abs(level) * largest / LARGEST,
        most_points=MOST_POINTS, largest=largest,
    )  # fmt: skip


def _turns(first: ContinuationState, middle: ContinuationState, last: ContinuationState) -> bool:
    return (middle.value - first.value) * (last.value - middle.value) < 0


def _turn(
    path: LevelPath, level: float, points: list[ContinuationState], sliders: InitialSliders
) -> tuple[list[SteadyState], float]:
    """Level at which an arc turns between three points, and states at the wanted level found there by short steps.

    Long steps may pass over a turn that reaches the wanted level; a turn close to it is followed with short steps.
    """
    coarse = _find_vertex(*points)
    # Sizes of the level are compared; that of a force against the direction of the load is negative.
    turned = points[1].value / level
    is_lowest = turned < points[0].value / level
    outside = turned > 1 if is_lowest else turned < 1
    if not outside or abs(coarse / level - 1) > CLOSE:
        return [], coarse
    arc, way = _make_arc(path, level, FINE), sum(_compute_distance(a, b) for a, b in pairwise(points))
    walked = [replace(points[0], step=FINE)]
    states: list[SteadyState] = []
    while walked[-1].stop_reason is None and way > 0:
        walked.append(arc.advance(walked[-1])[1])
        way -= _compute_distance(walked[-2], walked[-1])
        states += _find_passed(path, level, walked[-2], walked[-1], sliders)
    turns = [_find_vertex(*three) for three in zip(walked, walked[1:], walked[2:], strict=False) if _turns(*three)]
    return states, (min(turns, key=abs) if is_lowest else max(turns, key=abs)) if turns else coarse


def _compute_distance(first: ContinuationState, last: ContinuationState) -> float:
    return float(np.linalg.norm(last.motion - first.motion))


def _find_passed(
    path: LevelPath, level: float, before: ContinuationState, after: ContinuationState, sliders: InitialSliders
) -> list[SteadyState]:
    """The state at a level between two points of an arc; empty if there is none, or it is not found."""
    if (before.value - level) * (after.value - level) > 0 or before.value == after.value:
        return []
    balance, condensed = path.at(level)
    change = after.motion - before.motion
    length = float(np.linalg.norm(change))
    start = before.motion + (level - before.value) / (after.value - before.value) * change
    result = newton_from(balance, condensed, start, sliders)
    if result is None or np.linalg.norm(result.motion - start) > NEAR * length:
        # Beside a fold the arc is bent: follow it at growing distances from the first point.
        result = newton_from(balance, condensed, _find_motion_along(path, level, before, after, sliders), sliders)
    if result is None or np.linalg.norm(result.motion - start) > length:
        return []
    return [result]


def _find_motion_along(
    path: LevelPath, level: float, before: ContinuationState, after: ContinuationState, sliders: InitialSliders
) -> Real:
    """Motion where the arc between two points passes a level."""
    x, value = np.array(before.motion), before.value
    metric = Metric(float(np.linalg.norm(x)) or 1.0, abs(after.value - value))
    way = Direction(after.motion - x, after.value - value)
    length = metric.length(way)
    t = Direction(way.motion / length, way.value / length)
    motion = x

    def beyond(share: float) -> float:
        nonlocal motion
        ahead = Direction(share * way.motion, share * way.value)
        result = correct_in_plane(path, x, value, t, share * length, metric, sliders, ahead)
        if result is None:
            raise NoSteadyState("", Failure.NEWTON)
        motion = result.motion
        return result.value - level

    # Where the arc cannot be followed, or does not pass the level, the last motion is returned.
    with suppress(NoSteadyState, ValueError):
        brentq(beyond, 0.0, 1.0, xtol=LOCATED)
    return motion


def _find_vertex(first: ContinuationState, middle: ContinuationState, last: ContinuationState) -> float:
    """Level at which an arc turns, by the parabola over its length through three points."""
    before, after = -_compute_distance(first, middle), _compute_distance(middle, last)
    if not before or not after:
        return middle.value
    down, up = (first.value - middle.value) / before, (last.value - middle.value) / after
    curvature = (up - down) / (after - before)
    slope = down - curvature * before
    return middle.value - slope**2 / (4 * curvature) if curvature else middle.value
