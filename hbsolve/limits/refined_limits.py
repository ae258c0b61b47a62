"""Limits with the harmonics and samples that a tolerance needs.

A search finds the slider positions of a limit. The size of the response there depends on the harmonics: the state at
each limit is computed again with more harmonics and the same sliders. Sliders that are extreme with few harmonics are
not always extreme with many: the refined response is possible, but there may be responses beyond it.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fe.blas_threads import on_one_blas_thread
from hbsolve.balance import HarmonicBalance
from hbsolve.joint_law.registry import FORCE
from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.result import REFINED, ResponseLimits
from hbsolve.refinement import MARGIN, check_output_rows, check_tolerance, refine_harmonics
from hbsolve.solution import forces_at
from hbsolve.state import SteadyState
from hbsolve.truncation import compute_relative_change, truncation
from reduction.array_type import Matrix

#: Size of a limit, over the largest of its level, below which its change is relative to this [-]: at an antiresonance a
#: relative error is meaningless.
MIN_RELATIVE_LIMIT = 1e-3
#: Change by refinement, over the tolerance, beyond which a limit is marked [-]: a search with the refined H changed 6
#: of 21 such limits of random systems at H = 2, and 2 of 35 others, by more than 1 %.
MOVED = 2.0


@on_one_blas_thread
def refine_limits(
    problem: LimitProblem,
    limits: ResponseLimits,
    tolerance: float,
    *,
    rows: Matrix | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseLimits:
    """The same limits with `refined`, `refined_error`, `refined_harmonic` and `refined_moved`.

    Parameters
    ----------
    problem
        Problem of the limits.
    limits
        Limits of a search.
    tolerance
        Largest relative change of the objective, and of the main harmonic of the rows [-].
    rows
        Rows of the motion whose amplitude is the objective, shape (n, r) [-]: limits with an estimated error below the
        tolerance are then kept. By default the joint directions together; the state at every limit is then computed
        with at least twice the harmonics, because there is no estimate for forces.
    report
        Called with the number of finished limits and of all limits.

    Raises
    ------
    BalanceError
        A tolerance that is not positive, rows of another size, or limits of another problem.
    """
    limit, rows = check_tolerance(tolerance), check_output_rows(problem.balance, rows)
    arrays = {name: np.array(getattr(limits, name)) for name in REFINED}
    largest = [float(np.nanmax(np.abs(item), initial=0.0)) for item in np.moveaxis(limits.value, 1, 0)]
    arrays["refined_harmonic"][:] = problem.balance.n_harmonic - 1
    known = np.argwhere(np.isfinite(limits.value)).tolist()
    for number, (side, level, at) in enumerate(known):
        state = limits.state(problem.balance, list(LimitSide)[side], level, at)
        for name, value in _refine(problem, state, limit, rows, MIN_RELATIVE_LIMIT * largest[level]).items():
            arrays[name][side, level, at] = value
        if report is not None:
            report(number + 1, len(known))
    return replace(limits, **arrays)


def _refine(
    problem: LimitProblem, state: SteadyState, tolerance: float, rows: Matrix | None, least: float
) -> dict[str, float]:
    """Values of the arrays of `REFINED` at a limit; the limit is NaN if no state was found with more harmonics."""
    balance = problem.balance.at_level(state.level)

    def measured(finer: HarmonicBalance, steady: SteadyState) -> tuple[float, float]:
        condensed = finer.at(steady.angular_frequency)
        measure = problem.objective.measure(finer, condensed)
        forces = forces_at(finer, steady.angular_frequency, steady.motion, steady.sliders, FORCE)
        value = measure.value(finer.level, steady.motion, forces.coefficients)
        return value, max(measure.least, least)

    (searched, size), smallest = measured(balance, state), 0.0 if rows is None else least
    if rows is not None:
        q, change = state.coefficients[balance.main_harmonic], MARGIN * truncation(balance, state).change
        error = float(compute_relative_change(balance, change, q, rows, smallest).max())
        if error <= tolerance:
            return dict(zip(REFINED, (searched, error, balance.n_harmonic - 1, False), strict=True))
    result = refine_harmonics(balance, state, tolerance, rows=rows, least=smallest, watch=measured)
    is_finer = result.balance.n_harmonic > balance.n_harmonic
    value = measured(result.balance, result.state)[0] if is_finer else np.nan
    moved = abs(value - searched) > MOVED * tolerance * max(abs(searched), size)
    return dict(zip(REFINED, (value, result.error, result.balance.n_harmonic - 1, moved), strict=True))
