"""A steady state from one start: Newton's method, from the start and from rest, then a ramp of the level."""

from collections.abc import Callable
from functools import partial

import numpy as np

from hbsolve.aft import InitialSliders, JointForces, joint_forces
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import CENTRING_STIFFNESS, Condensed, Recovery
from hbsolve.errors import BalanceError, Failure, NoSteadyState
from hbsolve.joint_law.registry import FORCE, JACOBIAN
from hbsolve.newton import NO_LOAD, BalancePoint, apply_receptance, imbalance, newton
from hbsolve.sampling import complex_from_real
from hbsolve.state import SteadyState, start_motion
from reduction.array_type import Real

#: |R| of a solution relative to the linear motion of the directions.
TOLERANCE = 1e-9
MAX_ITERATION = 40
#: A body drifts if its vibration, over its mean displacement, is below the first, and the force of the centring
#: springs, over loads and mean joint forces, above the second: while joints stick, this force is 1e-9 of theirs.
DISTANT = 1e-3
DRIFT = 1e-6
#: First and smallest step of the level in the ramp, and iterations in each: a state near the last needs few.
FIRST_STEP, LEAST_STEP, STEP_ITERATION = 0.2, 1e-3, 15


def newton_from(
    balance: HarmonicBalance, condensed: Condensed, x: Real, sliders: InitialSliders, recovery: Recovery | None = None
) -> SteadyState | None:
    """The state that Newton's method alone finds from a motion, or None."""
    linear = balance.linear(condensed)
    scale = compute_linear_size(linear)
    result, norm, count = newton_at(balance, condensed, linear, x, sliders, TOLERANCE * scale, MAX_ITERATION)
    if not norm <= TOLERANCE * scale:
        return None
    return recover_state(balance, condensed, result, sliders, norm / scale, count, recovery)


def solve_at(
    balance: HarmonicBalance,
    condensed: Condensed,
    x: Real | None,
    sliders: InitialSliders,
    recovery: Recovery | None = None,
) -> SteadyState:
    """`steady_state` with a given linear structure at Omega, and optionally the recovery of the full response."""
    x = start_motion(balance, x)
    linear = balance.linear(condensed)
    with np.errstate(over="ignore"):
        scale = compute_linear_size(linear)
    if not np.isfinite(scale):
        raise BalanceError(
            f"the linear motion at {condensed.angular_frequency / (2 * np.pi):.6g} Hz, level {balance.level:g}, is "
            "too large for double precision: give smaller loads or a stiffer structure"
        )
    tolerance, iterations = TOLERANCE * scale, 0
    attempts: list[Callable[[], tuple[Real, float, int]]] = [
        partial(newton_at, balance, condensed, linear, guess, sliders, tolerance, MAX_ITERATION)
        for guess in (x, linear)
        if guess is not None
    ]
    attempts += [partial(ramp, balance, condensed, guess, sliders, scale) for guess in (linear, 0 * linear)]
    for attempt in attempts:
        result, norm, count = attempt()
        iterations += count
        if norm <= tolerance:
            refuse_drift(balance, condensed, result, sliders)
            return recover_state(balance, condensed, result, sliders, norm / scale, iterations, recovery)
    share = f", {norm / scale:.1e} of the linear motion" if scale > NO_LOAD else ""
    at_last = f"at |R| = {norm:.1e} m{share}" if np.isfinite(norm) else "below this level"
    raise NoSteadyState(
        f"no steady state was found at {condensed.angular_frequency / (2 * np.pi):.6g} Hz, level {balance.level:g}: "
        f"Newton's method from the start and from rest does not converge, and a ramp of the level stopped {at_last}"
    )


def refuse_drift(balance: HarmonicBalance, condensed: Condensed, x: Real, sliders: InitialSliders) -> None:
    """Refuse a body that is held by joints alone and whose mean force is carried by the centring springs.

    Raises
    ------
    NoSteadyState
        The body drifts.
    """
    vibration = float(np.linalg.norm(x[:, 1:]))
    if not (balance.structure.is_centred and vibration < DISTANT * float(np.linalg.norm(x[:, 0]))):
        return
    carried = float(np.linalg.norm(CENTRING_STIFFNESS * balance.structure.reference * x[:, 0]))
    mean = forces_at(balance, condensed.angular_frequency, x, sliders, FORCE).coefficients[:, 0]
    mean_force = np.linalg.norm(mean + balance.structure.reference * x[:, 0])
    system = balance.system
    loads = np.linalg.norm(system.static) + abs(balance.level) * np.linalg.norm(system.dynamic)
    if carried > DRIFT * float(loads + mean_force):
        raise NoSteadyState(
            f"at {condensed.angular_frequency / (2 * np.pi):.6g} Hz, level {balance.level:g}, the body that is held "
            "only by joints drifts: all of them slip, and the mean of their forces is not zero",
            Failure.DRIFT,
        )


def newton_at(
    balance: HarmonicBalance,
    condensed: Condensed,
    linear: Real,
    x: Real,
    sliders: InitialSliders,
    tolerance: float,
    limit: int,
) -> tuple[Real, float, int]:
    """Newton's method alone: motion, |R| [m] and iterations, also if it did not converge."""
    point = BalancePoint(linear, condensed.angular_frequency, condensed.columns, balance.arrays)
    result: tuple[Real, float, int] = newton(np.array(x, order="C"), point, sliders, tolerance, limit)
    return result


def ramp(
    balance: HarmonicBalance, condensed: Condensed, guess: Real, sliders: InitialSliders, scale: float
) -> tuple[Real, float, int]:
    """Raise the level from the static state in adaptive steps."""
    static = balance.linear(condensed, 0.0)
    x = static.copy()
    x[:, 0] = np.where(guess[:, 0] == 0, 0.0, static[:, 0])
    x, norm, iterations = newton_at(balance, condensed, static, x, sliders, TOLERANCE * scale, 3 * MAX_ITERATION)
    if not norm <= TOLERANCE * scale:
        return x, norm, iterations
    share, step, before = 0.0, FIRST_STEP, x
    while share < 1 and step >= LEAST_STEP:
        target = min(1.0, share + step)
        linear = balance.linear(condensed, target * balance.level)
        # The secant through the last two states predicts; at first the linear change does.
        change = (x - before) * step if share else linear - static
        trial, norm, count = newton_at(
            balance, condensed, linear, x + change, sliders, TOLERANCE * scale, STEP_ITERATION
        )
        iterations += count
        if norm <= TOLERANCE * scale:
            before = trial - (trial - x) / (target - share)
            x, share, step = trial, target, 2 * step
        else:
            step *= 0.4
    return x, norm if share >= 1 else np.inf, iterations


def forces_at(
    balance: HarmonicBalance, omega: float, x: Real, sliders: InitialSliders, want: int = JACOBIAN
) -> JointForces:
    """Joint forces at a motion of the directions."""
    x, omega = np.array(x, order="C"), float(omega)
    forces: JointForces = joint_forces(x, omega, balance.table, sliders, balance.sampling, want)
    return forces


def compute_linear_size(linear: Real) -> float:
    """|x_lin| [m], to which |R| is relative; at least `NO_LOAD`."""
    return max(float(np.linalg.norm(linear)), NO_LOAD)


def compute_relative_residual(
    balance: HarmonicBalance, condensed: Condensed, x: Real, forces: JointForces, R: Real
) -> float:
    """|R| over |x_lin|; zero where R is round-off [-]."""
    norm = float(imbalance(R, condensed.columns, np.array(x, order="C"), forces.coefficients))
    return norm / compute_linear_size(balance.linear(condensed))


def residual(balance: HarmonicBalance, condensed: Condensed, x: Real, forces: JointForces) -> Real:
    """R = x - x_lin + A g, eq. 12 in the joint directions, shape (d, nh) [m]."""
    return np.asarray(x - balance.linear(condensed) + apply_receptance(condensed.columns, forces.coefficients))


def recover_state(
    balance: HarmonicBalance,
    condensed: Condensed,
    x: Real,
    sliders: InitialSliders,
    norm: float,
    iterations: int,
    recovery: Recovery | None = None,
) -> SteadyState:
    """The steady state of a solution, with the full response.

    Raises
    ------
    NoSteadyState
        The state of a joint does not repeat every period, such as in ratcheting.
    """
    forces = forces_at(balance, condensed.angular_frequency, x, sliders, FORCE)
    if forces.unsettled.any():
        name = balance.system.joints[int(forces.unsettled.argmax())].name
        raise NoSteadyState(
            f"at {condensed.angular_frequency / (2 * np.pi):.6g} Hz, level {balance.level:g}, the state of joint "
            f'"{name}" does not repeat every period',
            Failure.MEMORY,
        )
    return SteadyState(
        angular_frequency=condensed.angular_frequency,
        level=balance.level,
        displacement=complex_from_real(x),
        coefficients=balance.response(condensed, forces.coefficients, recovery),
        initial_slider=sliders.value.copy(),
        multiplier=bool(sliders.by_multiplier.any()),
        # The last instant of one period precedes the first of the next.
        periodic_slider=forces.slider[:, -1].copy(),
        residual_norm=float(norm),
        iterations=iterations,
    )
