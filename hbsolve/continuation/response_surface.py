"""The force surface of a sensor: one curve under response control for each amplitude."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.controlled_amplitude import ControlledAmplitude
from hbsolve.continuation.controlled_response import begin_controlled, make_controlled_continuation, state_under_force
from hbsolve.continuation.response import follow_to_end
from hbsolve.continuation.surface import ResponseSurface
from hbsolve.errors import BalanceError, NoSteadyState
from hbsolve.solution import newton_from
from hbsolve.state import SteadyState, is_same_motion, make_initial_sliders
from reduction.array_input import check_array, refuse_infinite
from reduction.array_type import Real, Vector
from reduction.base_excitation import BaseExcitation


@on_one_blas_thread
def response_surface(
    balance: HarmonicBalance,
    row: int | Vector,
    angular_frequency: Sequence[float] | Float[Real, " p"],
    amplitude: Sequence[float] | Float[Real, " a"],
    *,
    derivative: int = 0,
    base: BaseExcitation | None = None,
    slider: Real | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseSurface:
    """Level of the force that holds each amplitude of a sensor at each frequency.

    For each amplitude the curve of `controlled_response` is followed from the lowest to the highest frequency. Where it
    passes a frequency several times, the first pass counts. Points that it does not reach are NaN. A structure, such as
    one with an absorber, may have several states under control as well: where neighbours are states of different
    sheets, the surface marks this and has no contours between them.

    Parameters
    ----------
    balance, row, derivative, base, slider
        As for `hbsolve.continuation.controlled_response.controlled_response`.
    angular_frequency
        Omega, ascending, at least two, shape (p,) [rad/s].
    amplitude
        Amplitudes of the first harmonic of the reading, ascending and positive, shape (a,) [m, m/s or m/s^2].
    report
        Called with the number of amplitudes done and of all amplitudes.

    Raises
    ------
    BalanceError
        As `ControlledAmplitude`; frequencies or amplitudes that do not ascend, or too few.
    """
    omega = _check_ascending(angular_frequency, "angular_frequency", 2)
    amplitudes = _check_ascending(amplitude, "amplitude", 1)
    sliders = make_initial_sliders(balance, slider)
    shape = len(amplitudes), len(omega)
    level, phase = np.full((2, *shape), np.nan)
    other_frequency, other_amplitude = np.zeros((2, *shape), dtype=np.bool_)
    below: _Curve | None = None
    for number, held in enumerate(amplitudes.tolist()):
        path = ControlledAmplitude(balance=balance, row=row, amplitude=held, derivative=derivative, base=base)
        curve = _follow(path, omega, sliders, below)
        for place, state in enumerate(curve.states):
            if state is not None:
                level[number, place] = state.level
                phase[number, place] = np.angle(path.reading_of(state))
        other_frequency[number] = curve.turned
        if below is not None:
            other_amplitude[number] = [not _are_connected(below, curve, place, sliders) for place in range(len(omega))]
        below = curve
        if report is not None:
            report(number + 1, len(amplitudes))
    return ResponseSurface(
        angular_frequency=omega, amplitude=amplitudes, level=level, phase=phase, derivative=int(derivative),
        other_frequency=other_frequency, other_amplitude=other_amplitude,
    )  # fmt: skip


class _Curve(NamedTuple):
    """Curve of one amplitude over the frequencies of the surface."""

    path: ControlledAmplitude
    omega: Float[Real, " p"]
    start: Real | None
    """Motion of the directions at the first frequency, in the phase of the reading; None if no state was found."""
    motions: list[Real | None]
    """The same at each frequency."""
    states: list[SteadyState | None]
    """States under the given force."""
    turned: list[bool]
    """Whether the curve turned between the frequency before and each."""


def _check_ascending(values: object, name: str, least: int) -> Float[Real, " n"]:
    given = check_array(values, name, BalanceError)
    if given.ndim != 1 or len(given) < least:
        raise BalanceError(f"{name} has shape {given.shape}: give a list of {least} numbers at least")
    refuse_infinite(given, name, BalanceError)
    if (np.diff(given) <= 0).any():
        place = int(np.flatnonzero(np.diff(given) <= 0)[0])
        raise BalanceError(f"{name} has {given[place]:g} before {given[place + 1]:g}: give ascending numbers")
    return given


def _follow(
    path: ControlledAmplitude, omega: Float[Real, " p"], sliders: InitialSliders, below: _Curve | None
) -> _Curve:
    """The curve of an amplitude; it begins near the curve of the amplitude below."""
    continuation = make_controlled_continuation(path, float(omega[0]), float(omega[-1]), None)
    start = (
        None
        if below is None or below.start is None
        else _scale_vibration(below.start, path.amplitude / below.path.amplitude)
    )
    n = len(omega)
    try:
        begun = begin_controlled(continuation, sliders, start)
    except NoSteadyState:
        return _Curve(path, omega, None, [None] * n, [None] * n, [False] * n)
    points = follow_to_end(continuation, begun)[0]
    passed = [_find_passed(points, value) for value in omega.tolist()]
    motions = [
        None if place is None else _interpolate_motion(path, points[place], points[place + 1], value, sliders)
        for place, value in zip(passed, omega.tolist(), strict=True)
    ]
    states = [_state_at(path, value, x, sliders) for value, x in zip(omega.tolist(), motions, strict=True)]
    turned = [False, *(_turns(points, first, last) for first, last in pairwise(passed))]
    return _Curve(path, omega, points[0][1].motion, motions, states, turned)


def _scale_vibration(motion: Real, ratio: float) -> Real:
    """A motion with its vibration, but not its mean, times a ratio."""
    result = ratio * motion
    result[:, 0] = motion[:, 0]
    return result


def _find_passed(points: Sequence[tuple[float, SteadyState]], value: float) -> int | None:
    """Index of the first point between which and the next a curve passes a frequency; None if it does not."""
    omega = np.array([at for at, _ in points])
    there = np.flatnonzero((omega[:-1] - value) * (omega[1:] - value) <= 0)
    return int(there[0]) if len(there) else None


def _turns(points: Sequence[tuple[float, SteadyState]], first: int | None, last: int | None) -> bool:
    """Whether a curve turns between two frequencies that it passes."""
    if first is None or last is None:
        return False
    return bool((np.diff([at for at, _ in points[first : last + 2]]) < 0).any())


def _interpolate_motion(
    path: ControlledAmplitude,
    first: tuple[float, SteadyState],
    last: tuple[float, SteadyState],
    value: float,
    sliders: InitialSliders,
) -> Real | None:
    """Motion at a frequency between two points of a curve; None if it is not found."""
    share = (value - first[0]) / (last[0] - first[0]) if last[0] != first[0] else 0.0
    balance, condensed = path.at(value)
    start = first[1].motion + share * (last[1].motion - first[1].motion)
    result = newton_from(balance, condensed, start, sliders)
    return None if result is None else result.motion


def _state_at(
    path: ControlledAmplitude, value: float, motion: Real | None, sliders: InitialSliders
) -> SteadyState | None:
    try:
        return None if motion is None else state_under_force(path, value, motion, sliders, 0)
    except NoSteadyState:
        return None


def _are_connected(below: _Curve, above: _Curve, place: int, sliders: InitialSliders) -> bool:
    """Whether Newton's method leads from each of two states at one frequency to the other."""
    low, high = below.motions[place], above.motions[place]
    if low is None or high is None:
        return False
    ratio, value = above.path.amplitude / below.path.amplitude, float(above.omega[place])
    for path, start, wanted in (
        (above.path, _scale_vibration(low, ratio), high),
        (below.path, _scale_vibration(high, 1 / ratio), low),
    ):
        result = newton_from(*path.at(value), start, sliders)
        if result is None or not is_same_motion(result.motion, wanted):
            return False
    return True
