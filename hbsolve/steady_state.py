"""A steady state at one frequency: Newton's method and what is tried when it fails."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hbsolve.aft import JointForces, Start, joint_forces
from hbsolve.balance import HarmonicBalance, Real
from hbsolve.condensed import Condensed, Recovery
from hbsolve.contact.law import JACOBIAN
from hbsolve.errors import BalanceError
from hbsolve.newton import apply_receptance, newton
from hbsolve.sampling import complex_from_real
from hbsolve.state import SteadyState, slider_start, start_motion
from reduction.jointed_system import FrictionContact

__all__ = [
    "NoConvergence",
    "SteadyState",
    "finished",
    "forces_at",
    "newton_at",
    "residual",
    "slider_start",
    "solve_at",
    "start_motion",
    "steady_state",
]

#: |R| of a solution relative to the linear motion of the directions.
TOLERANCE = 1e-9
MAX_ITERATION = 40
#: First step of the level in the ramp, the smallest one, and Newton steps in each.
FIRST_STEP, LEAST_STEP, RAMP_ITERATION = 0.2, 1e-3, 15


class NoConvergence(ArithmeticError):
    """No steady state was found; the message says where and what was tried."""


def steady_state(
    balance: HarmonicBalance,
    angular_frequency: float,
    *,
    start: SteadyState | Real | None = None,
    slider: Sequence[float] | NDArray[np.float64] | None = None,
    multiplier: bool = False,
) -> SteadyState:
    """Periodic response at one frequency.

    Parameters
    ----------
    balance
        The system, its harmonics and the level of its force.
    angular_frequency
        Omega [rad/s].
    start
        Motion to start from: a neighbouring state, or real coefficients of the directions; all contacts stuck by
        default.
    slider
        Slider positions at the first instant, shape (s,) [m]; zero by default, springs without tension at rest.
    multiplier
        Take `slider` as the multipliers m of eq. 11, T = m mu N at the first instant.

    Raises
    ------
    NoConvergence
        Newton's method failed from the start, from rest, along a ramp of the level, from many starts and along arcs
        of frequency and level.
    BalanceError
        A frequency that is not positive, sliders or a start that do not fit, or a motion too large to compute with.
    """
    sliders = slider_start(balance, slider, multiplier)
    x = start_motion(balance, start)
    condensed = balance.at(angular_frequency)
    try:
        return solve_at(balance, condensed, x, sliders)
    except NoConvergence:
        state = rescued(balance, condensed, x, sliders, start if isinstance(start, SteadyState) else None)
        if state is None:
            raise
        return state


def rescued(
    balance: HarmonicBalance, condensed: Condensed, x: Real | None, sliders: Start, before: SteadyState | None = None
) -> SteadyState | None:
    """What many starts about a motion, or an arc from another state, lead to where `solve_at` does not; maybe none."""
    from hbsolve.continuation.rescue import along_an_arc, from_many_starts  # which continue branches of these states

    found = from_many_starts(balance, condensed, x, sliders)
    if found is not None:
        return finished(balance, condensed, found[0], sliders, found[1], found[2])
    return along_an_arc(balance, condensed.angular_frequency, before, sliders)


def newton_from(
    balance: HarmonicBalance, condensed: Condensed, x: Real, sliders: Start, recovery: Recovery | None = None
) -> SteadyState | None:
    """The state that Newton's method alone finds from a motion; maybe none."""
    linear = balance.linear(condensed)
    scale = float(np.linalg.norm(linear)) or 1.0
    found, norm, count = newton_at(balance, condensed, linear, x, sliders, TOLERANCE * scale, MAX_ITERATION)
    if not norm <= TOLERANCE * scale:
        return None
    return finished(balance, condensed, found, sliders, norm / scale, count, recovery)


def solve_at(
    balance: HarmonicBalance, condensed: Condensed, x: Real | None, sliders: Start, recovery: Recovery | None = None
) -> SteadyState:
    """`steady_state` where the linear structure at Omega is at hand, and maybe what recovers the full response."""
    x = start_motion(balance, x)
    linear = balance.linear(condensed)
    with np.errstate(over="ignore"):
        scale = float(np.linalg.norm(linear))
    if not np.isfinite(scale):
        raise BalanceError(
            f"the linear motion at {condensed.angular_frequency / (2 * np.pi):.6g} Hz, level {balance.level:g}, is too "
            "large for the arithmetic: give smaller loads or a stiffer structure"
        )
    if scale == 0.0:
        scale = 1.0
    iterations = 0
    for attempt in (x, linear):
        if attempt is None:
            continue
        found, norm, count = newton_at(balance, condensed, linear, attempt, sliders, TOLERANCE * scale, MAX_ITERATION)
        iterations += count
        if norm <= TOLERANCE * scale:
            return finished(balance, condensed, found, sliders, norm / scale, iterations, recovery)
    for guess in (linear, 0 * linear):
        found, norm, count = ramp(balance, condensed, guess, sliders, scale)
        iterations += count
        if norm <= TOLERANCE * scale:
            return finished(balance, condensed, found, sliders, norm / scale, iterations, recovery)
    raise NoConvergence(
        f"no steady state was found at {condensed.angular_frequency / (2 * np.pi):.6g} Hz, level {balance.level:g}: "
        f"Newton's method from the start and from rest, and a ramp of the level, stopped at |R| = "
        f"{norm / scale:.1e} of the linear motion; {_advice(balance, sliders)}"
    )


def _advice(balance: HarmonicBalance, sliders: Start) -> str:
    """What to try where nothing was found."""
    elsewhere = "start from a neighbouring state, or continue a branch to here"
    pressed = [
        joint.name for joint in balance.system.joints
        if isinstance(joint, FrictionContact) and (joint.preload > 0 or joint.gap < 0)
    ]  # fmt: skip
    if not pressed or sliders.value.any():
        return elsewhere
    return f'"{pressed[0]}" is pressed before it moves and sliders start at 0: give `slider`, {elsewhere}'


def newton_at(
    balance: HarmonicBalance, condensed: Condensed, linear: Real, x: Real, sliders: Start, tolerance: float, limit: int
) -> tuple[Real, float, int]:
    """Newton's method alone: motion, |R| [m] and iterations, whether it converged or not."""
    first, count = balance.joint_of_direction
    found: tuple[Real, float, int] = newton(
        np.ascontiguousarray(x), linear, condensed.angular_frequency, condensed.receptance, balance.table, first, count,
        sliders, balance.sampling, tolerance, limit,
    )  # fmt: skip
    return found


def ramp(
    balance: HarmonicBalance, condensed: Condensed, guess: Real, sliders: Start, scale: float
) -> tuple[Real, float, int]:
    """Raise the level from the static state in steps that adapt."""
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
            balance, condensed, linear, x + change, sliders, TOLERANCE * scale, RAMP_ITERATION
        )
        iterations += count
        if norm <= TOLERANCE * scale:
            before = trial - (trial - x) / (target - share)
            x, share, step = trial, target, 2 * step
        else:
            step *= 0.4
    return x, norm if share >= 1 else np.inf, iterations


def forces_at(balance: HarmonicBalance, omega: float, x: Real, sliders: Start, want: int = JACOBIAN) -> JointForces:
    """Joint forces at a motion of the directions."""
    forces: JointForces = joint_forces(np.ascontiguousarray(x), omega, balance.table, sliders, balance.sampling, want)
    return forces


def residual(balance: HarmonicBalance, condensed: Condensed, x: Real, forces: JointForces) -> Real:
    """R = x - x_lin + A g, eq. 12 in the joint directions, shape (d, nh) [m]."""
    return np.asarray(x - balance.linear(condensed) + apply_receptance(condensed.receptance, forces.coefficients))


def finished(
    balance: HarmonicBalance,
    condensed: Condensed,
    x: Real,
    sliders: Start,
    norm: float,
    iterations: int,
    recovery: Recovery | None = None,
) -> SteadyState:
    """A solution with the full response recovered."""
    forces = forces_at(balance, condensed.angular_frequency, x, sliders, want=0)
    return SteadyState(
        angular_frequency=condensed.angular_frequency,
        level=balance.level,
        displacement=complex_from_real(x),
        coefficients=balance.response(condensed, forces.coefficients, recovery),
        slider=sliders.value.copy(),
        multiplier=bool(sliders.by_multiplier.any()),
        # The last instant of one period precedes the first of the next.
        slider_at_start=forces.slider[:, -1].copy(),
        residual_norm=float(norm),
        iterations=iterations,
    )
