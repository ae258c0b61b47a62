"""A branch with the harmonics and samples that each of its points needs."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_share
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.errors import BalanceError
from hbsolve.refinement import MARGIN, RefinedState, check_output_rows, check_tolerance, refine_harmonics
from hbsolve.solution import compute_relative_residual, forces_at, residual
from hbsolve.state import SteadyState, make_initial_sliders
from hbsolve.truncation import compute_relative_change, compute_row_amplitude
from reduction.array_type import Matrix, Real

#: Amplitude of a row, over the largest of its branch, below which its change is relative to this [-]: at an
#: antiresonance a relative error has no meaning.
MIN_RELATIVE_AMPLITUDE = 1e-3
#: Residual of a point, over the linear motion, above which it was found with another balance or other sliders: a
#: thousand times the tolerance of the solver, and far below the residual of such a point.
MAX_RESIDUAL_OF_BRANCH = 1e-6


def refine_branch(
    balance: HarmonicBalance,
    branch: ResponseBranch,
    tolerance: float,
    *,
    rows: Matrix | None = None,
    slider: Real | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """The same branch with more harmonics where their estimated error, times `MARGIN`, exceeds a tolerance.

    Each of these points is found again at its frequency and level by `refine_harmonics`. In the result,
    `estimated_change` is the last change of these points and `MARGIN` times the estimate of others; `truncation_error`
    is that of the joint directions, by harmonics and samples together, and `sample_error` of refined points is NaN.
    `branch_errors` shows where the tolerance is not reached.

    Parameters
    ----------
    balance
        Balance with which the branch was found.
    branch
        Branch over frequency or level, with error estimates.
    tolerance, rows
        As for `hbsolve.refinement.refine_harmonics`.
    slider
        Slider positions with which the branch was found, shape (s,) [m]; zero by default.
    report
        Called with the number of points done and of all points to be refined.

    Raises
    ------
    BalanceError
        A branch without estimates, or of another balance or other sliders, and as `refine_harmonics`.
    """
    limit, rows = check_tolerance(tolerance), check_output_rows(balance, rows)
    if not branch.estimated_change.size:
        raise BalanceError("the branch has no estimated_change: give one of `frequency_response` or `level_response`")
    widened = replace(
        branch,
        estimated_change=MARGIN * branch.estimated_change,
        truncation_error=MARGIN * (branch.truncation_error + branch.sample_error),
    )
    least = MIN_RELATIVE_AMPLITUDE * compute_row_amplitude(
        balance, branch.coefficients[:, balance.main_harmonic], rows
    ).max(axis=0)
    wanted = np.flatnonzero(branch_errors(balance, widened, rows).max(axis=1, initial=0.0) > limit).tolist()
    given = make_initial_sliders(balance, slider).value
    points: dict[int, RefinedState] = {}
    for index in wanted:
        state = replace(branch.state(balance, index), initial_slider=given)
        at_point = branch.balance_at(balance, index)
        _refuse_foreign(at_point, state)
        points[index] = refine_harmonics(at_point, state, limit, rows=rows, least=least)
        if report is not None:
            report(len(points), len(wanted))
    return _with_points(widened, points)


def branch_errors(balance: HarmonicBalance, branch: ResponseBranch, rows: Matrix | None = None) -> Real:
    """Estimated relative error of the main harmonic of each point and row, shape (p, n) [-].

    The error is relative to the amplitude of the point, or to a thousandth of the largest of the branch if that is
    larger.

    Parameters
    ----------
    balance
        Balance with which the branch was found.
    branch
        Branch with error estimates.
    rows
        Rows over all degrees of freedom, shape (n, r) [-]; by default the joint directions together (n = 1).
    """
    q = branch.coefficients[:, balance.main_harmonic]
    least = MIN_RELATIVE_AMPLITUDE * compute_row_amplitude(balance, q, rows).max(axis=0, initial=0.0)
    return compute_relative_change(balance, branch.estimated_change, q, rows, least)


def _refuse_foreign(balance: HarmonicBalance, state: SteadyState) -> None:
    """Refuse a state that does not solve a balance, because its joints or its sliders differ."""
    condensed = balance.at(state.angular_frequency)
    forces = forces_at(balance, state.angular_frequency, state.motion, state.sliders)
    R = residual(balance, condensed, state.motion, forces)
    left = compute_relative_residual(balance, condensed, state.motion, forces, R)
    if not left <= MAX_RESIDUAL_OF_BRANCH:
        raise BalanceError(
            f"the point at {state.frequency:.6g} Hz has a residual of {left:.1e} of the linear motion: give the "
            "balance and the sliders with which the branch was found, over frequency or level"
        )


def _with_points(branch: ResponseBranch, points: dict[int, RefinedState]) -> ResponseBranch:
    """The branch with these points in place of its own."""
    n_harmonic = max([branch.coefficients.shape[1], *(item.balance.n_harmonic for item in points.values())])
    count, before, n_dof = branch.coefficients.shape
    coefficients = np.zeros((count, n_harmonic, n_dof), dtype=np.complex128)
    coefficients[:, :before] = branch.coefficients
    names = (
        "residual_norm", "iterations", "periodic_slider", "contact_share", "truncation_error", "sample_error",
        "estimated_change", "highest_harmonic", "n_sample",
    )  # fmt: skip
    arrays: dict[str, Any] = {name: np.array(getattr(branch, name)) for name in names}
    for index, item in points.items():
        state, of_point = item.state, item.balance
        coefficients[index] = 0.0
        coefficients[index, : len(state.coefficients)] = state.coefficients
        moved = state.coefficients[of_point.main_harmonic]
        values = (
            state.residual_norm, state.iterations, state.periodic_slider, contact_share(of_point, state),
            compute_relative_change(of_point, item.change, moved)[0], np.nan,
            item.change, of_point.n_harmonic - 1, of_point.n_sample,
        )  # fmt: skip
        for name, value in zip(names, values, strict=True):
            arrays[name][index] = value
    return replace(branch, coefficients=coefficients, **arrays)
