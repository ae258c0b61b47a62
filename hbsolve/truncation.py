"""Errors due to truncated harmonics and the number of samples, estimated by one Newton step of a finer balance."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.linearised import active_rows, scattered, times_jacobian
from hbsolve.newton import newton_step
from hbsolve.solution import forces_at, residual
from hbsolve.state import SteadyState, check_state, in_harmonics_of
from reduction.array_type import Array, Matrix, Real

#: Amplitude of a row, over the sum of the amplitudes that it weights, below which it is round-off and residual [-].
STILL = 1e-6
#: If twice the samples change the state by more than the first number, and by more than the harmonics do, the harmonics
#: are estimated again with samples times the second number: for friction as a steep function of the velocity, 256
#: samples did not show an error of 24 % [-].
COARSE_CHANGE, FINER = 1e-3, 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Truncation:
    """Estimated errors of the main harmonic, the lowest harmonic of the load."""

    harmonics: float
    """Relative change of the joint directions by harmonics H + 1 to 2 H + 1 on the same samples (on more samples if
    they are too few for these harmonics, or for the joints) [-]."""
    samples: float
    """Relative change of the joint directions by twice the samples [-]. The error itself is about 4/3 of it, since the
    laws are of second order in the distance of the samples, and up to twice as large where a contact closes between two
    samples and sticks at once."""
    change: Complex[Array, " r"]
    """Change of all degrees of freedom by both, shape (r,) [m]."""


def truncation(balance: HarmonicBalance, state: SteadyState) -> Truncation:
    """Estimate both errors of a state; zero where there are no joints.

    The estimate is the first Newton step from the state in a balance with more harmonics, or more samples. It is not
    exact, since contacts may change their state in further steps.

    Raises
    ------
    BalanceError
        A state of another balance.
    """
    check_state(balance, state)
    if not balance.n_direction or not np.linalg.norm(state.motion):  # no motion, or squares that underflow
        return Truncation(harmonics=0.0, samples=0.0, change=np.zeros(balance.system.n_dof, dtype=np.complex128))
    at_level = balance.at_level(state.level)
    n_harmonic = 2 * balance.n_harmonic
    n_sample = max(balance.n_sample, 4 * n_harmonic)
    directions, moved, main = balance.structure.directions, state.displacement, balance.main_harmonic
    size = float(np.linalg.norm(moved[main])) or float(np.linalg.norm(moved))

    def estimate(finer: HarmonicBalance) -> tuple[Complex[Array, " r"], float]:
        change = _compute_first_step(finer, state)[main]
        return change, float(np.linalg.norm(directions @ change)) / size

    by_samples, samples = estimate(at_level.with_samples(2 * balance.n_sample))
    by_harmonics, harmonics = estimate(at_level.with_harmonics(n_harmonic, n_sample))
    if samples > max(harmonics, COARSE_CHANGE):
        # A step of a force between two samples is not resolved, and harmonics then seem to change nothing.
        with suppress(BalanceError):  # where they do not fit into memory
            by_harmonics, harmonics = estimate(at_level.with_harmonics(n_harmonic, FINER * n_sample))
    return Truncation(
        harmonics=harmonics,
        samples=samples,
        change=by_harmonics + by_samples,
    )


def compute_relative_change(
    balance: HarmonicBalance,
    change: Complex[Array, "... r"],
    coefficients: Complex[Array, "... r"],
    rows: Matrix | None = None,
    least: Float[Real, " n"] | float = 0.0,
) -> Float[Real, "... n"]:
    """Change of each row over its amplitude, shape (..., n) [-]; zero where nothing moves.

    Parameters
    ----------
    balance
        System whose joint directions are compared, all together (n = 1), where no rows are given.
    change, coefficients
        Change and coefficients of one harmonic of all degrees of freedom, shape (..., r) [m].
    rows
        Rows over all degrees of freedom, shape (n, r) [-].
    least
        Amplitude below which a change is relative to this, shape (n,) [m].
    """
    read = balance.structure.directions if rows is None else rows
    floor = STILL * (np.abs(coefficients) @ np.abs(read.T))
    if rows is None:
        floor = np.linalg.norm(floor, axis=-1, keepdims=True)
    amplitude = np.maximum(np.maximum(compute_row_amplitude(balance, coefficients, rows), floor), least)
    changed = compute_row_amplitude(balance, change, rows)
    return np.divide(changed, amplitude, out=np.zeros_like(changed), where=amplitude > 0)


def compute_row_amplitude(
    balance: HarmonicBalance, coefficients: Complex[Array, "... r"], rows: Matrix | None = None
) -> Float[Real, "... n"]:
    """Amplitude of each row, or the norm of the joint directions (n = 1) where none are given, shape (..., n) [m]."""
    if rows is None:
        return np.asarray(np.linalg.norm(coefficients @ balance.structure.directions.T, axis=-1, keepdims=True))
    return np.asarray(np.abs(coefficients @ rows.T))


def _compute_first_step(balance: HarmonicBalance, state: SteadyState) -> Complex[Array, "harmonic r"]:
    """Change of the response in the first Newton step from a state with fewer harmonics or samples [m]."""
    x, omega = in_harmonics_of(balance, state.motion), state.angular_frequency
    condensed, recovery = balance.at_with_recovery(omega) if balance.is_dense else (balance.at(omega), None)
    forces = forces_at(balance, omega, x, state.sliders)
    first, count = balance.joint_of_direction
    R = residual(balance, condensed, x, forces)
    step = newton_step(forces, condensed.columns, first, count, R, 0.0)
    rows = active_rows(forces.active)
    force_step = scattered(rows, times_jacobian(rows, forces.jacobian, first, count, step), *x.shape)
    after = balance.response(condensed, forces.coefficients - force_step, recovery)
    after[: len(state.coefficients)] -= state.coefficients
    return after
