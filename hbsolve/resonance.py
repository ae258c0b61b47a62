"""Resonance peaks of nonlinear forced response: one peak, and the peak against the level of the force."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.optimize import brentq

from hbsolve.balance import HarmonicBalance
from hbsolve.branch import ResponseBranch
from hbsolve.continuation import frequency_response
from hbsolve.errors import PeakError
from hbsolve.sensitivity import FrequencyParameter, sensitivity
from hbsolve.steady_state import NoConvergence, SteadyState, steady_state

Row = int | Float[NDArray[np.float64], " r"]

#: Half width of the window of the next level, in widths and shifts of the last peak, and how often it may be widened.
WIDTHS, SHIFTS, WIDENINGS = 8.0, 3.0, 6
#: Relative accuracy of the peak's frequency.
ACCURACY = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Resonance:
    """The highest response of a branch.

    Parameters
    ----------
    state
        At the peak; its amplitude at the output is the peak's.
    amplitude
        Of the fundamental at the output [m].
    """

    state: SteadyState
    amplitude: float

    @property
    def frequency(self) -> float:
        """Where the peak is [Hz]."""
        return self.state.frequency


def resonance(
    balance: HarmonicBalance, branch: ResponseBranch, row: Row, slider: NDArray[np.float64] | None = None
) -> Resonance:
    """The peak of a frequency response, between its points: where the exact derivative of the amplitude vanishes.

    Parameters
    ----------
    balance
        With which the branch was found.
    branch
        From `frequency_response`.
    row
        A degree of freedom, or the row of an output.
    slider
        As of the branch.

    Raises
    ------
    PeakError
        The response is highest at an end of the branch.
    """
    amplitude = branch.amplitude(row)
    top = int(amplitude.argmax())
    if not 0 < top < len(amplitude) - 1:
        raise PeakError(
            f"the response is highest at {branch.frequency[top]:.6g} Hz, an end of the branch: widen its range"
        )
    omega = branch.angular_frequency
    start = branch.start(balance, top)

    def solved(value: float) -> SteadyState:
        return steady_state(balance, value, start=start, slider=slider)

    def slope(value: float) -> float:
        state = solved(value)
        change = sensitivity(balance, state, [FrequencyParameter()])[0]
        return float((_at(change[1], row) * np.conj(_at(state.coefficients[1], row))).real)

    at = float(omega[top])
    try:
        low, high = sorted((float(omega[top - 1]), float(omega[top + 1])))
        if low < at < high and slope(low) > 0 > slope(high):
            at = float(brentq(slope, low, high, xtol=ACCURACY * at))
        state = solved(at)
    except NoConvergence:
        state = solved(float(omega[top]))
    if state.amplitude(row) < amplitude[top]:  # another state of the same frequency, next to a fold
        state = solved(float(omega[top]))
    return Resonance(state=state, amplitude=state.amplitude(row))


def resonance_curve(
    balance: HarmonicBalance,
    levels: Sequence[float],
    row: Row,
    first: float,
    last: float,
    *,
    slider: NDArray[np.float64] | None = None,
    report: Callable[[float, float], None] | None = None,
) -> tuple[Resonance, ...]:
    """Peak against level: the range of the first level is given, those of the next ones follow the peak.

    Parameters
    ----------
    balance
        The system.
    levels
        Of the harmonic force, in the order in which the peak is followed.
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
    PeakError
        A peak left its window even after that was widened.
    """
    peaks: list[Resonance] = []
    low, high = sorted((first, last))
    for number, level in enumerate(levels):
        for widening in range(WIDENINGS):
            try:
                branch = frequency_response(balance.at_level(level), low, high, slider=slider)
                peaks.append(resonance(balance.at_level(level), branch, row, slider))
                break
            except PeakError:
                if widening == WIDENINGS - 1:
                    raise
                low, high = max(low - (high - low) / 2, 0.01 * low), high + (high - low) / 2
        at = peaks[-1].state.angular_frequency
        shift = abs(at - peaks[-2].state.angular_frequency) if number else 0.0
        half = max(WIDTHS * _width(branch, row), SHIFTS * shift, 1e-3 * at)
        low, high = max(at - half, 0.1 * at), at + half
        if report is not None:
            report(number + 1, len(levels))
    return tuple(peaks)


def _width(branch: ResponseBranch, row: Row) -> float:
    """Extent in Omega of the part of a branch that is higher than 0.7 of its top [rad/s]."""
    amplitude = branch.amplitude(row)
    near = branch.angular_frequency[amplitude >= amplitude.max() / np.sqrt(2)]
    return float(near.max() - near.min())


def _at(coefficients: NDArray[np.complex128], row: Row) -> complex:
    return complex(coefficients[row] if isinstance(row, int | np.integer) else coefficients @ np.asarray(row))
