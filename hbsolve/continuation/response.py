"""Continuation of steady states over frequency, level or a joint's parameter, round folds: whole branches.

The single steps are `hbsolve.continuation.step`'s, for those who want to keep, show or stop them.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance, Real
from hbsolve.continuation.branch import ResponseBranch, branch_of
from hbsolve.continuation.path import FrequencyPath, JointPath, LevelPath
from hbsolve.continuation.state import ContinuationState
from hbsolve.continuation.step import REACHED, Continuation

__all__ = [
    "REACHED",
    "Continuation",
    "ContinuationState",
    "frequency_response",
    "joint_response",
    "level_response",
    "run",
]


def run(
    continuation: Continuation,
    start: Real | None = None,
    slider: NDArray[np.float64] | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """A whole branch.

    Parameters
    ----------
    continuation
        What, from where to where.
    start, slider
        As `hbsolve.steady_state.steady_state`.
    report
        Called with the way done and the whole way.
    """
    found, state = continuation.begin(start, slider)
    states, values, way = [found], [state.value], abs(continuation.last - continuation.first)
    while not state.stop_reason:
        point, state = continuation.advance(state)
        if point is not None:
            states.append(point)
            values.append(state.value)
        if report is not None:
            report(abs(state.value - continuation.first), way)
    path = continuation.path
    # A joint's parameter is part of the balance; frequency and level are part of the state.
    balances = [path.at(value)[0] for value in values] if isinstance(path, JointPath) else path.balance
    return branch_of(balances, states, state.stop_reason)


def frequency_response(
    balance: HarmonicBalance,
    first: float,
    last: float,
    *,
    step: float | None = None,
    slider: NDArray[np.float64] | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Forced response over frequency, round folds.

    Parameters
    ----------
    balance
        The system, its harmonics and the level of its force.
    first, last
        Range of Omega, in either order [rad/s].
    step
        Largest step [rad/s]; a fiftieth of the range by default.
    slider
        Initial slider positions, shape (s,) [m]; zero by default.
    report
        Called with the way done and the whole way.
    """
    return run(
        Continuation(path=FrequencyPath(balance=balance), first=first, last=last, step=step), None, slider, report
    )


def level_response(
    balance: HarmonicBalance,
    angular_frequency: float,
    first: float,
    last: float,
    *,
    step: float | None = None,
    slider: NDArray[np.float64] | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Response at one frequency over the level of the force, round folds; see `frequency_response`."""
    path = LevelPath(balance=balance, angular_frequency=angular_frequency)
    return run(Continuation(path=path, first=first, last=last, step=step), None, slider, report)


def joint_response(
    balance: HarmonicBalance,
    angular_frequency: float,
    joint: str,
    parameter: str,
    first: float,
    last: float,
    *,
    step: float | None = None,
    slider: NDArray[np.float64] | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Response at one frequency over a parameter of a joint, round folds; see `frequency_response`."""
    path = JointPath(balance=balance, angular_frequency=angular_frequency, joint=joint, parameter=parameter)
    return run(Continuation(path=path, first=first, last=last, step=step), None, slider, report)
