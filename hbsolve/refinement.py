"""Refinement of harmonics and samples to a tolerance: a state is found again with twice of both until it is stationary.

The change from one balance to the next finer one is the error of the coarser. The finer state is the result; its own
error is smaller where errors decrease.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from jaxtyping import Complex, Float

from fe.blas_threads import on_one_blas_thread
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.solution import newton_from
from hbsolve.state import SteadyState, check_state, in_harmonics_of
from hbsolve.steady_state import FEW_STARTS, from_many_starts
from hbsolve.truncation import compute_relative_change, truncation
from reduction.array_input import check_array, check_real_number, check_whole_number
from reduction.array_type import Array, Matrix, Real

#: Default limit of the highest harmonic, over that of the coarse balance [-].
MOST_TIMES = 8
#: Error over its estimate by one Newton step: larger for one random state in ten (`benchmarks/truncation_estimate.py`).
MARGIN = 3.0


class RefinementStop(Enum):
    """Reason why a refinement ends; the value is the reason and, after a colon, advice."""

    TOLERANCE = "the tolerance is reached"
    MOST_HARMONICS = (
        "the largest number of harmonics does not reach the tolerance: allow more harmonics, or a larger tolerance"
    )
    MEMORY = "more harmonics do not fit into the free memory: allow a larger tolerance"
    NO_STATE = "no state was found with more harmonics: begin with more, or continue a branch with more"


@dataclass(frozen=True, kw_only=True, eq=False)
class RefinedState:
    """A steady state with the harmonics that a tolerance needs."""

    state: SteadyState
    """State in the harmonics of `balance`."""
    balance: HarmonicBalance
    """Balance with which the state was found, at the level of the state."""
    change: Complex[Array, " r"]
    """Last change of the main harmonic of all degrees of freedom, or the next change as estimated by
    `hbsolve.truncation` if that is larger; `MARGIN` times the estimate if no finer state was found; shape (r,) [m]."""
    error: float
    """Largest change relative to the amplitude, over all rows and the watched number [-]."""
    stop: RefinementStop
    """Whether the tolerance is reached, and if not, the reason."""


@on_one_blas_thread
def refine_harmonics(
    balance: HarmonicBalance,
    state: SteadyState,
    tolerance: float,
    *,
    rows: Matrix | None = None,
    least: Float[Real, " n"] | float = 0.0,
    most: int | None = None,
    watch: Callable[[HarmonicBalance, SteadyState], tuple[float, float]] | None = None,
) -> RefinedState:
    """Find a state again with twice the harmonics and samples, until the change is less than a tolerance.

    The next change as estimated by `hbsolve.truncation` must also be less.

    Parameters
    ----------
    balance
        Balance with which the state was found.
    state
        Coarse state; its sliders are those of every finer one.
    tolerance
        Largest relative change of the main harmonic, the lowest one that the load acts at [-].
    rows
        Rows whose displacement is to be accurate, such as those of sensors, shape (n, r) [-]; by default the joint
        directions together.
    least
        Amplitude below which a change is relative to this, shape (n,) [m].
    most
        Limit of the highest harmonic; by default eight times that of the balance.
    watch
        Function that returns a further number of a state that is to be accurate, such as a contact force, and the size
        below which a change of this number is relative to that size. The next change of the number is not estimated.

    Raises
    ------
    BalanceError
        A state of another balance, a tolerance that is not positive, or rows of another size.
    """
    check_state(balance, state)
    limit, rows = check_tolerance(tolerance), check_output_rows(balance, rows)
    highest = (
        MOST_TIMES * max(balance.n_harmonic - 1, 1) if most is None else check_whole_number(most, "most", BalanceError)
    )
    coarse, main = balance.at_level(state.level), balance.main_harmonic

    def refined(change: Complex[Array, " r"], stop: RefinementStop) -> RefinedState:
        error = float(compute_relative_change(coarse, change, state.coefficients[main], rows, least).max(initial=0.0))
        return RefinedState(state=state, balance=coarse, change=change, error=error, stop=stop)

    result = refined(MARGIN * truncation(coarse, state).change, RefinementStop.MOST_HARMONICS)
    before = 0.0 if watch is None else watch(coarse, state)[0]
    while True:
        n_harmonic = min(2 * max(coarse.n_harmonic - 1, 1), highest) + 1
        if n_harmonic <= coarse.n_harmonic:
            return result
        try:
            finer = coarse.with_harmonics(n_harmonic, max(2 * coarse.n_sample, 4 * n_harmonic))
        except BalanceError:
            return replace(result, stop=RefinementStop.MEMORY)
        finer_state = _find_again(finer, state)
        if finer_state is None:
            return replace(result, stop=RefinementStop.NO_STATE)
        change = finer_state.coefficients[main] - state.coefficients[main]
        coarse, state = finer, finer_state
        result = refined(change, RefinementStop.MOST_HARMONICS)
        if watch is not None:
            watched, size = watch(coarse, state)
            moved = abs(watched - before) / max(abs(watched), size)
            before, result = watched, replace(result, error=max(result.error, moved))
        if result.error <= limit:
            # A resonant harmonic beyond those of the finer balance may change more: the estimate shows it.
            ahead = refined(truncation(coarse, state).change, RefinementStop.MOST_HARMONICS)
            result = max(result, ahead, key=lambda item: item.error)
            if result.error <= limit:
                return replace(result, stop=RefinementStop.TOLERANCE)


def check_tolerance(tolerance: float) -> float:
    """Return a relative tolerance; refuse (`BalanceError`) one that is not positive."""
    limit = check_real_number(tolerance, "tolerance", BalanceError)
    if not limit > 0:
        raise BalanceError(f"tolerance = {limit:g} must be positive: 0.01 is 1 %")
    return limit


def check_output_rows(balance: HarmonicBalance, rows: Matrix | None) -> Matrix | None:
    """Return rows over all degrees of freedom; refuse (`BalanceError`) those of another size."""
    if rows is None:
        return None
    given = check_array(rows, "rows", BalanceError)
    if given.ndim != 2 or given.shape[1] != balance.system.n_dof:
        raise BalanceError(f"rows have shape {given.shape}: give (n, {balance.system.n_dof}), one weight per degree")
    return given


def _find_again(finer: HarmonicBalance, state: SteadyState) -> SteadyState | None:
    """The same state with more harmonics and samples; None if Newton's method does not find it."""
    x, condensed = in_harmonics_of(finer, state.motion), finer.at(state.angular_frequency)
    result = newton_from(finer, condensed, x, state.sliders)
    return from_many_starts(finer, condensed, x, state.sliders, FEW_STARTS) if result is None else result
