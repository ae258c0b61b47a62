"""Whole branches of steady states over frequency, level or a joint's parameter, round folds.

Single steps, which a caller can show or stop, are in `hbsolve.continuation.step`.
"""

from collections.abc import Callable, Sequence

import numpy as np

from fe.blas_threads import on_one_blas_thread
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_share
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.continuation_parameter import FrequencyPath, JointPath, LevelPath
from hbsolve.continuation.step import Continuation, ContinuationState
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import NoSteadyState
from hbsolve.solution import solve_at
from hbsolve.state import SteadyState, make_initial_sliders
from hbsolve.steady_state import steady_state
from hbsolve.truncation import truncation
from reduction.array_type import Real

#: Fraction of points that are folds above which folds are the reason for too many points [-]. For a random system with
#: two contacts and a friction coefficient of 4 it is 22 % with 128 samples, 17 % with 512 and 28 % with 2,048.
MOST_FOLDED = 0.05
#: Points of a branch so far, lambda and the steady state of each, and the state of its continuation.
PartialBranch = tuple[list[tuple[float, SteadyState]], ContinuationState]


def begin(
    continuation: Continuation, start: Real | None = None, slider: Real | None = None
) -> tuple[SteadyState, ContinuationState]:
    """Find the first point of a branch.

    Parameters
    ----------
    continuation
        Path, and its range of lambda.
    start, slider
        As for `hbsolve.steady_state.steady_state`.

    Raises
    ------
    NoSteadyState
        No steady state at the first value.
    """
    balance, condensed = continuation.path.at(continuation.first)
    sliders = make_initial_sliders(balance, slider)
    try:
        result = solve_at(balance, condensed, start, sliders)
    except NoSteadyState:
        result = steady_state(balance, condensed.angular_frequency, start=start, slider=sliders.value)
    return result, continuation.state_at(result.motion, sliders)


@on_one_blas_thread
def run(
    continuation: Continuation,
    start: Real | None = None,
    slider: Real | None = None,
    report: Callable[[float, float], None] | None = None,
    *,
    resumed: PartialBranch | None = None,
    save: Callable[[PartialBranch], None] | None = None,
) -> ResponseBranch:
    """Follow a whole branch.

    Parameters
    ----------
    continuation
        Path, and its range of lambda.
    start, slider
        As for `hbsolve.steady_state.steady_state`.
    report
        Called with the range of lambda done and the whole range.
    resumed
        Last argument of `save`, from which the branch continues.
    save
        Called after each point.

    Raises
    ------
    NoSteadyState
        No steady state at the first value.
    """
    if resumed is None:
        first, state = begin(continuation, start, slider)
        points = [(state.value, first)]
    else:
        points, state = resumed
    points, state, reason = follow_to_end(continuation, (points, state), report, save)
    path = continuation.path
    # A joint's parameter is part of the balance; frequency and level are part of the state.
    balances = [path.at(value)[0] if isinstance(path, JointPath) else path.balance for value, _ in points]
    return make_branch(balances, [item for _, item in points], reason, continuation.stopped_at(state), state.leaps)


def follow_to_end(
    continuation: Continuation,
    begun: PartialBranch,
    report: Callable[[float, float], None] | None = None,
    save: Callable[[PartialBranch], None] | None = None,
) -> tuple[list[tuple[float, SteadyState]], ContinuationState, StopReason]:
    """All points of a branch, including those already found, its last state and its stop reason; see `run`."""
    points, state = list(begun[0]), begun[1]
    way = abs(continuation.last - continuation.first)
    while state.stop_reason is None:
        point, state = continuation.advance(state)
        if point is not None:
            points.append((state.value, point))
            if save is not None:
                save((points, state))
        if report is not None:
            report(abs(state.value - continuation.first), way)
    reason = state.stop_reason
    if reason is StopReason.MOST_POINTS and _count_folds([value for value, _ in points]) > MOST_FOLDED * len(points):
        reason = StopReason.FOLDED
    return points, state, reason


def _count_folds(values: Sequence[float]) -> int:
    """Number of times that lambda turns."""
    ways = np.sign(np.diff(values))
    return int(np.count_nonzero(ways[1:] * ways[:-1] < 0))


def frequency_response(
    balance: HarmonicBalance,
    first: float,
    last: float,
    *,
    step: float | None = None,
    level_power: int = 0,
    slider: Real | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Forced response over frequency, round folds.

    Parameters
    ----------
    balance
        System, its harmonics and the level of its force.
    first, last
        Range of Omega, in either order [rad/s].
    step
        Largest step [rad/s]; a fiftieth of the range by default.
    level_power
        Power p: the level is that of the balance times Omega^p; 2 for a constant displacement of a base or an unbalance
        [-].
    slider
        Initial slider positions, shape (s,) [m]; zero by default.
    report
        Called with the range done and the whole range.
    """
    path = FrequencyPath(balance=balance, level_power=level_power)
    return run(Continuation(path=path, first=first, last=last, step=step), None, slider, report)


def level_response(
    balance: HarmonicBalance,
    angular_frequency: float,
    first: float,
    last: float,
    *,
    step: float | None = None,
    slider: Real | None = None,
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
    slider: Real | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Response at one frequency over a parameter of a joint, round folds; see `frequency_response`."""
    path = JointPath(balance=balance, angular_frequency=angular_frequency, joint=joint, parameter=parameter)
    return run(Continuation(path=path, first=first, last=last, step=step), None, slider, report)


def make_branch(
    balances: Sequence[HarmonicBalance],
    states: Sequence[SteadyState],
    stop_reason: StopReason,
    stopped_at: str = "",
    leaps: tuple[int, ...] = (),
) -> ResponseBranch:
    """Steady states as a branch, with contact states and error estimates.

    Each state has its own balance; the level of that balance may differ from that of the state.
    """
    errors = [truncation(item, state) for item, state in zip(balances, states, strict=True)]
    return ResponseBranch(
        angular_frequency=np.array([item.angular_frequency for item in states]),
        coefficients=np.array([item.coefficients for item in states]),
        residual_norm=np.array([item.residual_norm for item in states]),
        stop_reason=stop_reason,
        stopped_at=stopped_at,
        leaps=leaps,
        level=np.array([item.level for item in states]),
        iterations=np.array([item.iterations for item in states], dtype=np.float64),
        periodic_slider=np.array([item.periodic_slider for item in states]),
        contact_share=np.array([contact_share(b, item) for b, item in zip(balances, states, strict=True)]),
        joint_names=tuple(joint.name for joint in balances[0].system.joints) if balances else (),
        truncation_error=np.array([item.harmonics for item in errors]),
        sample_error=np.array([item.samples for item in errors]),
        estimated_change=np.array([item.change for item in errors]),
        n_sample=np.array([item.n_sample for item in balances], dtype=np.float64),
    )
