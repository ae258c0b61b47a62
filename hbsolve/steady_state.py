"""A steady state at one frequency: one start, then a few, then an arc to the frequency, then many starts.

If contacts slide near a resonance of the linear structure, Newton's method may cycle between the smooth pieces of the
residual without converging. Its path depends on the start, and some starts converge; along an arc of solutions, small
steps keep it close to a solution.
"""

from collections.abc import Sequence

import numpy as np

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import InitialSliders
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.continuation.continuation_parameter import FrequencyPath, LevelPath
from hbsolve.continuation.step import Continuation
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import Failure, NoSteadyState
from hbsolve.sampling import real_from_complex
from hbsolve.solution import TOLERANCE, compute_linear_size, newton_at, recover_state, refuse_drift, solve_at
from hbsolve.state import SteadyState, make_initial_sliders, start_motion
from reduction.array_type import Real

#: Number of starts, iterations in each, and the seed that makes them reproducible.
N_START, ITERATIONS, SEED = 200, 60, 0
#: Number of starts that are tried first: in half of the cases one of these converges if any does, and in nearly all
#: cases where a state is known in fewer harmonics.
FEW_STARTS = 16
#: Number of joint directions up to which all starts are tried, and least number of starts with more directions: the
#: cost of an iteration grows with the square of the directions.
FEW_DIRECTIONS, LEAST_START = 12, 8
#: Relative spread of a start about the motion given, and about the stuck one.
SPREAD, STUCK_SPREAD = 0.3, 0.1
#: Largest number of points of an arc, its step relative to its length, and the first level of an arc of levels relative
#: to the last.
ARC_POINTS, ARC_STEP, LOW_LEVEL = 400, 0.2, 1e-2


@on_one_blas_thread
def steady_state(
    balance: HarmonicBalance,
    angular_frequency: float,
    *,
    start: SteadyState | Real | None = None,
    slider: Sequence[float] | Real | None = None,
    multiplier: bool = False,
) -> SteadyState:
    """Periodic response at one frequency.

    Parameters
    ----------
    balance
        System, its harmonics and the level of its force.
    angular_frequency
        Omega [rad/s].
    start
        Motion to start from: a neighbouring state, or real coefficients of the directions; all contacts stuck by
        default.
    slider
        Slider positions at the first instant, shape (s,) [m]; zero by default, springs without tension at rest.
    multiplier
        Whether `slider` holds the multipliers m of eq. 11, T = m mu N at the first instant.

    Raises
    ------
    NoSteadyState
        Newton's method failed from the start, from rest, along a ramp of the level, from many starts and along arcs
        of frequency and level.
    BalanceError
        A frequency that is not positive, sliders or a start that do not fit, or a motion too large to compute with.
    """
    sliders = make_initial_sliders(balance, slider, multiplier)
    x = start_motion(balance, start)
    condensed = balance.at(angular_frequency)
    try:
        return solve_at(balance, condensed, x, sliders)
    except NoSteadyState as error:
        if error.failure is Failure.DRIFT:
            raise
        state = solve_from_other_starts(
            balance, condensed, x, sliders, start if isinstance(start, SteadyState) else None
        )
        if state is None:
            if _rest_leads_on(balance, condensed, sliders):
                raise NoSteadyState(error.args[0], Failure.SLIDERS_UNSET) from None
            raise
    refuse_drift(balance, condensed, real_from_complex(state.displacement), sliders)
    return state


def _rest_leads_on(balance: HarmonicBalance, condensed: Condensed, sliders: InitialSliders) -> bool:
    """Whether a state exists with sliders at their positions under the static load in place of 0."""
    if sliders.value.any():
        return False
    try:
        rest = solve_at(balance.at_level(0.0), condensed, None, sliders)
        if not rest.periodic_slider.any():
            return False
        solve_at(balance, condensed, None, make_initial_sliders(balance, rest.periodic_slider))
    except NoSteadyState:
        return False
    return True


def solve_from_other_starts(
    balance: HarmonicBalance,
    condensed: Condensed,
    x: Real | None,
    sliders: InitialSliders,
    before: SteadyState | None = None,
) -> SteadyState | None:
    """Solution from many starts about a motion, or along an arc from another state, after `solve_at` failed; or None.

    A few starts take as long as an arc, and many starts ten times as long.
    """
    result = from_many_starts(balance, condensed, x, sliders, FEW_STARTS)
    if result is None:
        result = along_an_arc(balance, condensed.angular_frequency, before, sliders)
    return from_many_starts(balance, condensed, x, sliders, failed=FEW_STARTS) if result is None else result


def from_many_starts(
    balance: HarmonicBalance, condensed: Condensed, x: Real | None, sliders: InitialSliders, n_start: int = N_START,
    *, failed: int = 0,
) -> SteadyState | None:  # fmt: skip
    """Solution from the first start that converges, or None.

    Parameters
    ----------
    balance, condensed, sliders
        Harmonic balance, its structure at the frequency, and initial sliders.
    x
        Motion about which the starts vary; that with all contacts stuck by default.
    n_start
        Number of starts, if there are few joint directions [-].
    failed
        `n_start` of an earlier call without a solution: its starts are the first of these, and are skipped [-].
    """
    linear = balance.linear(condensed)
    scale = compute_linear_size(linear)
    near = linear if x is None else x
    random = np.random.default_rng(SEED)
    share = min(1.0, FEW_DIRECTIONS / max(balance.n_direction, 1)) ** 2
    done, last = (max(LEAST_START, round(n * share)) if n else 0 for n in (failed, n_start))
    for number in range(last):
        if number % 2:
            start = near * (1 + SPREAD * random.normal(size=near.shape))
        else:
            start = linear + (near - linear) * random.uniform(-0.5, 1.5)
            start = start + STUCK_SPREAD * linear * random.normal(size=near.shape)
        if number < done:
            continue
        result, norm, count = newton_at(balance, condensed, linear, start, sliders, TOLERANCE * scale, ITERATIONS)
        if norm <= TOLERANCE * scale:
            return recover_state(balance, condensed, result, sliders, norm / scale, count)
    return None


def along_an_arc(
    balance: HarmonicBalance, angular_frequency: float, before: SteadyState | None, sliders: InitialSliders
) -> SteadyState | None:
    """The state reached along an arc from another frequency's state, else from a low level; None if both fail."""
    arcs: list[tuple[FrequencyPath | LevelPath, float, float, Real | None]] = []
    if before is not None and before.angular_frequency != angular_frequency and before.level == balance.level:
        arcs.append((FrequencyPath(balance=balance), before.angular_frequency, angular_frequency, before.motion))
    if balance.level:
        levels = LevelPath(balance=balance, angular_frequency=angular_frequency)
        arcs.append((levels, LOW_LEVEL * balance.level, balance.level, None))
    for path, first, last, start in arcs:
        arc = Continuation(path=path, first=first, last=last, step=ARC_STEP * abs(last - first), most_points=ARC_POINTS)
        try:
            at, condensed = path.at(first)
            result = solve_at(at, condensed, start, sliders)
            state = arc.state_at(result.motion, sliders)
        except NoSteadyState:
            continue
        point: SteadyState | None = None
        while state.stop_reason is None:
            point, state = arc.advance(state)
        if state.stop_reason is StopReason.REACHED:
            return point
    return None
