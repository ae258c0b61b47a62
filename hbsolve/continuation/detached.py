"""Detached curves: isolas and other curves over frequency that are not connected with a given one at its level.

At several frequencies the state is followed over the level, round its folds. Where this arc passes the level of the
curve there is a state. If it lies on no known curve, it begins a new curve, which is followed both ways until it closes
(an isola) or leaves the range. An isola is born at a lower level and merges with the main curve at a higher one; the
arc over the level connects the two.

The arcs begin at frequencies of the range, at the peaks of the curve, and, where the folds of an arc miss the level of
the curve by little, at frequencies beside it, towards the least miss. An isola that no arc reaches is not found: one
that does not merge with the main curve up to the highest level of the arcs, or one narrower than the distance of the
frequencies whose arcs have no folds beside it.

References
----------
Habib, Cirillo and Kerschen, Nonlinear Dynamics 93 (2018): isolas are born and merge as the level grows.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.arclength import Direction, Metric, tangent
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.continuation_parameter import FrequencyPath, equation
from hbsolve.continuation.level_arc import LevelArc, follow_level
from hbsolve.continuation.peak import interpolated_peak
from hbsolve.continuation.response import make_branch
from hbsolve.continuation.step import Continuation, ContinuationState, Mark
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import NoPeakError
from hbsolve.solution import newton_from
from hbsolve.state import SteadyState, is_same_motion, make_initial_sliders
from reduction.array_type import Real

#: Number of frequencies of the range, and of peaks of the curve, from which arcs begin.
N_FREQUENCY, N_PEAK = 9, 3
#: Largest miss of the level by a fold, relative to the level, for which a smaller miss is sought [-].
MOST_MISSED = 0.5
#: Largest number of frequencies about which a fold with a smaller miss is sought, and of halvings of their distance.
MOST_REFINED, N_HALVED = 2, 3
#: Miss predicted by a parabola, relative to the present one, up to which a fold is sought [-].
WORTHWHILE = 0.5
#: Largest number of points of all arcs, per point of the curve and at least, beyond which no further arc begins: the
#: search takes no longer than a few curves.
POINTS, LEAST_POINTS = 2, 300
#: Largest number of detached curves, so that a curve that ended early is not completed from everywhere.
MOST_CURVES = 6
#: Number of points of a curve that are compared with another one.
N_COMPARED = 5


@dataclass(frozen=True)
class Bracket:
    """A frequency at which the nearest fold misses the level by less than at the two neighbouring frequencies."""

    missed: float
    lower: float
    middle: float
    upper: float


@on_one_blas_thread
def detached_curves(
    balance: HarmonicBalance,
    branch: ResponseBranch,
    first: float,
    last: float,
    *,
    level_power: int = 0,
    step: float | None = None,
    slider: Real | None = None,
    report: Callable[[float, float], None] | None = None,
) -> tuple[ResponseBranch, ...]:
    """Curves over frequency that are not connected with a branch of `frequency_response`, in the order of discovery.

    Parameters
    ----------
    balance, first, last, step, level_power, slider
        As for `frequency_response`, which found the branch.
    branch
        Curve beside which others are sought.
    report
        Called with the number of arcs done and of all arcs.
    """
    search = _Search(balance, first, last, step, level_power, slider)
    if not balance.level or not balance.n_direction or len(branch.angular_frequency) < 2:
        return ()
    search.curves.append(branch)
    seeds = search.frequencies()
    arcs = {}
    for number, omega in enumerate(seeds, start=1):
        if search.may_go_on:
            arcs[omega] = search.along_level(omega)
        if report is not None:
            report(number, len(seeds))
    ends = [search.upward.first, *sorted(arcs), search.upward.last]
    for bracket in _find_brackets(ends, [arcs[omega] for omega in sorted(arcs)]):
        search.refine(bracket)
    return tuple(search.curves[1:])


class _Search:
    """Known curves, and the range in which others are sought."""

    def __init__(
        self,
        balance: HarmonicBalance,
        first: float,
        last: float,
        step: float | None,
        level_power: int,
        slider: Real | None,
    ) -> None:
        self.balance, self.level_power = balance, level_power
        self.sliders = make_initial_sliders(balance, slider)
        path = FrequencyPath(balance=balance, level_power=level_power)
        self.upward = Continuation(path=path, first=min(first, last), last=max(first, last), step=step)
        self.downward = Continuation(path=path, first=max(first, last), last=min(first, last), step=step)
        self.curves: list[ResponseBranch] = []
        self.n_point = 0

    @property
    def may_go_on(self) -> bool:
        """Whether the number of points of the arcs is below its limit."""
        return self.n_point < max(LEAST_POINTS, POINTS * len(self.curves[0].angular_frequency))

    def frequencies(self) -> list[float]:
        """Frequencies at which arcs begin, peaks first [rad/s]."""
        first, last = self.upward.first, self.upward.last
        edge = (last - first) / (2 * N_FREQUENCY)
        evenly = np.linspace(first + edge, last - edge, N_FREQUENCY)
        peaks = _find_peaks(self.curves[0])
        return [*peaks, *(item for item in evenly.tolist() if all(abs(item - peak) > edge for peak in peaks))]

    def along_level(self, angular_frequency: float) -> LevelArc:
        """The arc at one frequency; those of its states that lie on no known curve begin new ones."""
        balance, _ = self.upward.path.at(angular_frequency)
        arc = follow_level(balance, angular_frequency, self.sliders)
        self.n_point += arc.n_point
        for state in arc.states:
            if len(self.curves) <= MOST_CURVES and not any(self.lies_on(state, curve) for curve in self.curves):
                curve = self.curve_through(state)
                if curve is not None and not any(self._is_same(curve, other) for other in self.curves):
                    self.curves.append(curve)
        return arc

    def refine(self, bracket: Bracket) -> None:
        """Follow arcs at frequencies about a bracket's, towards the least miss of the level by a fold."""
        lower, middle, upper = bracket.lower, bracket.middle, bracket.upper
        missed = bracket.missed
        for _ in range(N_HALVED):
            spans = [(curve.angular_frequency.min(), curve.angular_frequency.max()) for curve in self.curves[1:]]
            if not self.may_go_on or any(first <= middle <= last for first, last in spans):
                return
            below, above = (lower + middle) / 2, (middle + upper) / 2
            values = {middle: missed, **{item: self.along_level(item).missed for item in (below, above)}}
            best = min((value, at) for at, value in values.items())
            if best[1] == middle and _find_lowest(values) > WORTHWHILE * missed:
                return
            lower, upper = {below: (lower, middle), middle: (below, above), above: (middle, upper)}[best[1]]
            missed, middle = best

    def lies_on(self, state: SteadyState, curve: ResponseBranch) -> bool:
        """Whether a state is one of the states of a curve at its frequency."""
        size = float(np.linalg.norm(state.motion)) or 1.0
        balance, condensed = self.upward.path.at(state.angular_frequency)
        for start, length in _list_passes(curve, balance, state.angular_frequency):
            if np.linalg.norm(start - state.motion) > length + 0.1 * size:
                continue
            result = newton_from(balance, condensed, start, self.sliders)
            if result is not None and is_same_motion(result.motion, state.motion):
                return True
        return False

    def curve_through(self, state: SteadyState) -> ResponseBranch | None:
        """The curve over frequency on which a state lies; None if it cannot be followed."""
        points, reason = self._follow(self.upward, state)
        if reason is not StopReason.ISOLA:
            before, other = self._follow(self.downward, state)
            points = [*reversed(before[1:]), *points]
            reason = other if reason is StopReason.REACHED else reason
        if len(points) < 2:
            return None
        # States of a branch carry the level that holds at their frequency.
        return make_branch([self.balance] * len(points), points, reason)

    def _follow(self, continuation: Continuation, state: SteadyState) -> tuple[list[SteadyState], StopReason]:
        """Points from a state to where its curve closes, or leaves the range at either end."""
        points, reason = self._one_way(continuation, state)
        if reason is StopReason.TURNED_BACK:
            # It left the range at the end where the branch would begin: the last step goes to that end.
            other = self.downward if continuation is self.upward else self.upward
            rest, reason = self._one_way(other, points[-1])
            points += rest[1:]
        return points, reason

    def _one_way(self, continuation: Continuation, state: SteadyState) -> tuple[list[SteadyState], StopReason]:
        """Points from a state on, and the reason why they end."""
        at = _set_out(continuation, state, self.sliders)
        mark = at.mark
        points = [state]
        while at.stop_reason is None:
            point, at = continuation.advance(at)
            if at.leaps:  # possibly to another curve
                return points, StopReason.FAILED
            if point is not None:
                points.append(point)
            # Keep the mark, so that the curve is followed round once and not until it meets a moving mark.
            at = replace(at, mark=mark)
        if at.stop_reason is StopReason.CLOSED:
            return [*points, state], StopReason.ISOLA
        return points, at.stop_reason

    def _is_same(self, curve: ResponseBranch, other: ResponseBranch) -> bool:
        """Whether two curves are the same: most of the points agree, since a state beside a fold may be missed."""
        count = len(curve.angular_frequency)
        chosen = np.unique(np.linspace(0, count - 1, N_COMPARED + 2).astype(int)[1:-1]).tolist()
        shared = 0
        for index in chosen:
            balance, condensed = self.upward.path.at(float(curve.angular_frequency[index]))
            state = newton_from(balance, condensed, curve.start(balance, index), self.sliders)
            shared += state is not None and self.lies_on(state, other)
        return 2 * shared > len(chosen)


def _set_out(continuation: Continuation, state: SteadyState, sliders: InitialSliders) -> ContinuationState:
    """State of a continuation that begins at a steady state inside the range, with its mark there."""
    motion, value = state.motion, state.angular_frequency
    at = continuation.state_at(motion, sliders)
    size = float(np.linalg.norm(motion[:, 1:])) or 1.0
    here = equation(continuation.path, value, motion, sliders)
    ahead, orientation = tangent(here, at.tangent, Metric(size, abs(at.tangent.value)), 0)
    mark = Mark(Direction(motion, value), ahead, 1)
    return replace(at, value=value, tangent=ahead, orientation=orientation, mark=mark)


def _list_passes(
    curve: ResponseBranch, balance: HarmonicBalance, angular_frequency: float
) -> Iterator[tuple[Real, float]]:
    """Motions near which a curve passes a frequency, and the distance between the two points beside each."""
    omega = curve.angular_frequency
    for index in np.flatnonzero((omega[:-1] - angular_frequency) * (omega[1:] - angular_frequency) <= 0).tolist():
        before, after = curve.start(balance, index), curve.start(balance, index + 1)
        way = float(omega[index + 1] - omega[index])
        share = (angular_frequency - float(omega[index])) / way if way else 0.0
        yield before + share * (after - before), float(np.linalg.norm(after - before))


def _find_peaks(curve: ResponseBranch) -> list[float]:
    """Frequencies of the highest local maxima of the vibration of the whole structure, between points."""
    size = np.linalg.norm(curve.coefficients[:, 1:], axis=(1, 2))
    inner = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    highest = inner[np.argsort(-size[inner], kind="stable")][:N_PEAK]
    return [_find_vertex(curve.angular_frequency[at - 1 : at + 2], size[at - 1 : at + 2]) for at in highest.tolist()]


def _find_vertex(omega: Real, size: Real) -> float:
    """Frequency of the peak of three points; that of the middle one if they do not enclose a peak."""
    try:
        return interpolated_peak(omega, size).angular_frequency
    except NoPeakError:
        return float(omega[1])


def _find_lowest(missed: dict[float, float]) -> float:
    """Least value of the parabola through three misses; 0 where one is not known."""
    first, middle, last = sorted(missed)
    before, after = missed[first] - missed[middle], missed[last] - missed[middle]
    if not np.isfinite([before, after]).all():
        return 0.0
    falling, rising = before / (first - middle), after / (last - middle)
    curvature = (rising - falling) / (last - first)
    slope = falling - curvature * (first - middle)
    return missed[middle] - slope**2 / (4 * curvature) if curvature > 0 else missed[middle]


def _find_brackets(frequencies: Sequence[float], arcs: Sequence[LevelArc]) -> list[Bracket]:
    """Frequencies at which a fold misses the level by little, and by less than beside; the ends have no arcs."""
    missed = [np.inf, *(arc.missed for arc in arcs), np.inf]
    result = [
        Bracket(missed[index], *frequencies[index - 1 : index + 2])
        for index in range(1, len(frequencies) - 1)
        if missed[index] < MOST_MISSED and missed[index - 1] >= missed[index] < missed[index + 1]
    ]
    return sorted(result, key=lambda item: item.missed)[:MOST_REFINED]
