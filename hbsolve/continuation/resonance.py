"""Resonance peaks of nonlinear forced response: one peak, and the peak against the level of the force."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.optimize import brentq

from fe.blas_threads import on_one_blas_thread
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.arclength import Direction
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.branch_path import make_path
from hbsolve.continuation.continuation_parameter import FrequencyPath, level_at
from hbsolve.continuation.response import frequency_response
from hbsolve.continuation.step import Continuation
from hbsolve.errors import BalanceError, NoPeakError, NoSteadyState
from hbsolve.sensitivity import FrequencyParameter, LevelParameter, sensitivity
from hbsolve.state import SteadyState, make_initial_sliders
from hbsolve.steady_state import steady_state
from reduction.array_type import Array, Real

Row = int | Float[Real, " r"]

#: Half width of the window of the next level, in widths and shifts of the last peak, and how often it may be widened.
WIDTHS, SHIFTS, WIDENINGS = 8.0, 3.0, 6
#: Relative accuracy of the peak's frequency.
ACCURACY = 1e-9
#: Where the branch folds beside its top, arc lengths of ever shorter steps over the top, relative to the amplitude, and
#: largest number of such steps.
FINER, FINER_POINTS = (0.03, 3e-3, 3e-4), 60


@dataclass(frozen=True, kw_only=True, eq=False)
class ResonantState:
    """The highest response of a branch."""

    state: SteadyState
    """State at the peak."""
    amplitude: float
    """Amplitude of the fundamental at the output [m]."""

    @property
    def frequency(self) -> float:
        """Frequency of the peak [Hz]."""
        return self.state.frequency


@on_one_blas_thread
def resonance(balance: HarmonicBalance, branch: ResponseBranch, row: Row, slider: Real | None = None) -> ResonantState:
    """The peak of a frequency response, between its points: the zero of the exact derivative of the amplitude.

    The level is that of the branch, which may follow a power of Omega.

    Parameters
    ----------
    balance
        Balance with which the branch was found, at any level.
    branch
        Result of `frequency_response`.
    row
        A degree of freedom, or the row of an output, shape (r,) [-].
    slider
        Initial sliders of the branch, shape (s,) [m]; unstressed springs at rest by default.

    Raises
    ------
    NoPeakError
        The response is highest at an end of the branch.
    BalanceError
        A branch that is not over frequency, or whose level follows no power of Omega.
    """
    path, _ = make_path(balance, branch)
    if not isinstance(path, FrequencyPath):
        raise BalanceError("the frequency does not change along the branch: give a result of `frequency_response`")
    amplitude = branch.amplitude(row)
    top = int(amplitude.argmax())
    if not 0 < top < len(amplitude) - 1:
        raise NoPeakError(
            f"the response is highest at {branch.frequency[top]:.6g} Hz, an end of the branch: widen its range"
        )
    points = [
        _Point(angular_frequency=float(branch.angular_frequency[at]), motion=branch.start(balance, at),
               amplitude=float(amplitude[at]))
        for at in (top - 1, top, top + 1)
    ]  # fmt: skip
    for share in (0.0, *FINER):
        if share:
            points = _refine_top(path, points, row, slider, share)
        state = _find_between(path, points, row, slider)
        if state is not None:
            break
    else:
        state = _solve(path, points[1].angular_frequency, points[1].motion, slider)
    return ResonantState(state=state, amplitude=state.amplitude(row))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Point:
    angular_frequency: float
    motion: Float[Real, "d nh"]
    amplitude: float


def _solve(path: FrequencyPath, angular_frequency: float, start: Real, slider: Real | None) -> SteadyState:
    """The state at a frequency, with the level at that frequency."""
    at_level = level_at(path.balance, angular_frequency, path.level_power)
    return steady_state(at_level, angular_frequency, start=start, slider=slider)


def _find_between(path: FrequencyPath, points: Sequence[_Point], row: Row, slider: Real | None) -> SteadyState | None:
    """The state where the amplitude is stationary between three points; None if a fold or a kink is between them."""
    before, top, behind = (item.angular_frequency for item in points)
    if not (top - before) * (behind - top) > 0:
        return None

    def solved(value: float) -> SteadyState:
        nearest = min(points, key=lambda item: abs(item.angular_frequency - value))
        return _solve(path, value, nearest.motion, slider)

    def slope(value: float) -> float:
        state = solved(value)
        by_frequency, by_level = sensitivity(path.balance, state, [FrequencyParameter(), LevelParameter()])
        change = by_frequency + path.level_power * state.level / value * by_level
        return float((_read_amplitude(change[1], row) * np.conj(_read_amplitude(state.coefficients[1], row))).real)

    low, high = sorted((before, behind))
    try:
        if not slope(low) > 0 > slope(high):
            return None
        state = solved(float(brentq(slope, low, high, xtol=ACCURACY * top)))
    except NoSteadyState:
        return None
    # A lower amplitude than at the points would be that of another state, next to a fold.
    return state if state.amplitude(row) >= (1 - ACCURACY) * points[1].amplitude else None


def _refine_top(
    path: FrequencyPath, points: Sequence[_Point], row: Row, slider: Real | None, share: float
) -> list[_Point]:
    """Three points about the top again, from an arc that begins at the first of them and takes shorter steps."""
    before, top = points[:2]
    at, reach = before.angular_frequency, float(np.ptp([item.angular_frequency for item in points]))
    if not reach:
        return list(points)
    # The ends of the arc are far away: following stops beyond the top.
    arc = Continuation(path=path, first=max(at - 10 * reach, at / 2), last=at + 10 * reach, step=reach)
    state = replace(
        arc.state_at(before.motion, make_initial_sliders(path.balance, slider)),
        value=at,
        tangent=Direction(top.motion - before.motion, top.angular_frequency - at),
    )
    finer = [before]
    for _ in range(FINER_POINTS):
        state = replace(state, step=min(state.step, share))
        result, state = arc.advance(state)
        if result is None:
            break
        omega, height = result.angular_frequency, result.amplitude(row)
        finer.append(_Point(angular_frequency=omega, motion=result.motion, amplitude=height))
        if len(finer) > 2 and height < finer[-2].amplitude:
            return finer[-3:]
        if state.stop_reason is not None:
            break
    return list(points)


@on_one_blas_thread
def resonance_curve(
    balance: HarmonicBalance,
    levels: Sequence[float],
    row: Row,
    first: float,
    last: float,
    *,
    slider: Real | None = None,
    report: Callable[[float, float], None] | None = None,
) -> tuple[ResonantState, ...]:
    """Peak against level: the range of the first level is given, those of the next ones follow the peak.

    Parameters
    ----------
    balance
        System and its harmonics.
    levels
        Levels of the harmonic force, in the order in which the peak is followed.
    row
        A degree of freedom, or the row of an output.
    first, last
        Range of Omega in which the peak of the first level lies [rad/s].
    slider
        As `steady_state`.
    report
        Called with the levels done and all levels.

    Raises
    ------
    NoPeakError
        A peak left its window even after the window was widened.
    """
    peaks: list[ResonantState] = []
    low, high = sorted((first, last))
    for number, level in enumerate(levels):
        for widening in range(WIDENINGS):
            try:
                branch = frequency_response(balance.at_level(level), low, high, slider=slider)
                peaks.append(resonance(balance, branch, row, slider))
                break
            except NoPeakError:
                if widening == WIDENINGS - 1:
                    raise
                low, high = max(low - (high - low) / 2, 0.01 * low), high + (high - low) / 2
        at = peaks[-1].state.angular_frequency
        shift = abs(at - peaks[-2].state.angular_frequency) if number else 0.0
        half = max(WIDTHS * _compute_width(branch, row), SHIFTS * shift, 1e-3 * at)
        low, high = max(at - half, 0.1 * at), at + half
        if report is not None:
            report(number + 1, len(levels))
    return tuple(peaks)


def _compute_width(branch: ResponseBranch, row: Row) -> float:
    """Extent in Omega of the part of a branch above 1 / sqrt(2) of its top [rad/s]."""
    amplitude = branch.amplitude(row)
    near = branch.angular_frequency[amplitude >= amplitude.max() / np.sqrt(2)]
    return float(near.max() - near.min())


def _read_amplitude(coefficients: Array, row: Row) -> complex:
    return complex(coefficients[row] if isinstance(row, int | np.integer) else coefficients @ np.asarray(row))
