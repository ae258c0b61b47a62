"""A steady state at one frequency: Newton's method and what is tried when it fails."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from hbsolve.aft import JointForces, Start, joint_forces
from hbsolve.balance import HarmonicBalance, Real
from hbsolve.condensed import Condensed
from hbsolve.contact.law import JACOBIAN
from hbsolve.errors import BalanceError
from hbsolve.newton import apply_receptance, newton
from hbsolve.sampling import complex_from_real, real_from_complex
from reduction.array_input import real_array
from reduction.jointed_system import FrictionContact

#: |R| of a solution relative to the linear motion of the directions.
TOLERANCE = 1e-9
MAX_ITERATION = 40
#: First step of the level in the ramp, the smallest one, and Newton steps in each.
FIRST_STEP, LEAST_STEP, RAMP_ITERATION = 0.2, 1e-3, 15


class NoConvergence(ArithmeticError):
    """No steady state was found; the message says where and what was tried."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SteadyState:
    """One periodic response; d joint directions, s sliders, harmonics 0 to H.

    Parameters
    ----------
    angular_frequency
        Omega [rad/s].
    level
        Scale of the harmonic force [-].
    displacement
        Coefficients of the joint directions, shape (H + 1, d) [m].
    coefficients
        Coefficients of all degrees of freedom, shape (H + 1, r) [m].
    slider
        Slider positions (or multipliers, see `multiplier`) at the first instant, as given, shape (s,) [m or -].
    multiplier
        Whether `slider` holds the multipliers m of eq. 11.
    slider_at_start
        Slider positions at the start of the steady period, shape (s,) [m].
    residual_norm
        |R| relative to the linear motion [-].
    iterations
        Newton iterations in all [-].
    """

    angular_frequency: float
    level: float
    displacement: Complex[NDArray[np.complex128], "harmonic d"]
    coefficients: Complex[NDArray[np.complex128], "harmonic r"]
    slider: Float[NDArray[np.float64], " s"]
    multiplier: bool
    slider_at_start: Float[NDArray[np.float64], " s"]
    residual_norm: float
    iterations: int

    @property
    def frequency(self) -> float:
        """Omega / (2 pi) [Hz]."""
        return self.angular_frequency / (2 * np.pi)

    @property
    def start(self) -> Start:
        """The sliders as the compiled code wants them."""
        return Start(np.array(self.slider), np.full(len(self.slider), int(self.multiplier)))

    @property
    def motion(self) -> Real:
        """`displacement` as real coefficients, shape (d, nh) [m]."""
        return real_from_complex(self.displacement)

    def amplitude(self, row: int | Float[NDArray[np.float64], " r"], harmonic: int = 1) -> float:
        """Amplitude of one harmonic of a degree of freedom, or of a row over all of them [m]."""
        q = self.coefficients[harmonic]
        return float(abs(q[row] if isinstance(row, int | np.integer) else q @ np.asarray(row)))


def slider_start(
    balance: HarmonicBalance, slider: Sequence[float] | NDArray[np.float64] | None, multiplier: bool
) -> Start:
    """Check the sliders that a caller gives; none means unstressed springs at rest.

    Raises
    ------
    BalanceError
        Another number than the system's sliders, or a multiplier beyond Coulomb's cone.
    """
    n = balance.n_slider
    value = np.zeros(n) if slider is None else np.array(real_array(slider, "slider", BalanceError))
    if value.shape != (n,):
        raise BalanceError(f"slider has shape {value.shape}: give {n} finite numbers, one a tangent in order of joints")
    if not np.isfinite(value).all():
        at = int(np.flatnonzero(~np.isfinite(value))[0])
        raise BalanceError(f"slider {at} starts at {value[at]}: give finite numbers")
    if multiplier and n and np.abs(value).max() > 1:
        worst = value[np.abs(value).argmax()]
        raise BalanceError(f"multiplier {worst:g} is outside [-1, 1]: it is the share of Coulomb's limit (eq. 11)")
    return Start(value, np.full(n, int(multiplier)))


def start_motion(balance: HarmonicBalance, start: SteadyState | Real | None) -> Real | None:
    """Check the motion to start from that a caller gives; compiled code does not.

    Raises
    ------
    BalanceError
        Another shape than the balance's, or entries that are no finite real numbers.
    """
    if start is None:
        return None
    n_direction, n_harmonic = balance.n_direction, balance.n_harmonic
    if isinstance(start, SteadyState):
        if start.displacement.shape != (n_harmonic, n_direction):
            raise BalanceError(
                f"the start is a state with displacement of shape {start.displacement.shape}, the balance has "
                f"{n_harmonic} harmonics with the mean and {n_direction} directions: give a state of this balance"
            )
        return start.motion
    x = real_array(start, "the start", BalanceError)
    wanted = (n_direction, 2 * n_harmonic - 1)
    if x.shape != wanted:
        raise BalanceError(
            f"the start has shape {x.shape}: give real coefficients of the directions, shape {wanted}, a steady state "
            "or a branch's `start`"
        )
    if not np.isfinite(x).all():
        raise BalanceError(f"the start holds {x[~np.isfinite(x)][0]}: give finite numbers")
    return x


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
        A frequency that is not positive, or sliders or a start that do not fit.
    """
    sliders = slider_start(balance, slider, multiplier)
    from hbsolve.rescue import along_an_arc, from_many_starts  # which continue branches of these states

    x = start_motion(balance, start)
    condensed = balance.at(angular_frequency)
    try:
        return solve_at(balance, condensed, x, sliders)
    except NoConvergence:
        found = from_many_starts(balance, condensed, x, sliders)
        if found is not None:
            return finished(balance, condensed, found[0], sliders, found[1], found[2])
        before = start if isinstance(start, SteadyState) else None
        state = along_an_arc(balance, angular_frequency, before, sliders)
        if state is None:
            raise
        return state


def solve_at(balance: HarmonicBalance, condensed: Condensed, x: Real | None, sliders: Start) -> SteadyState:
    """`steady_state` where the linear structure at Omega is at hand."""
    x = start_motion(balance, x)
    linear = balance.linear(condensed)
    scale = float(np.linalg.norm(linear))
    if scale == 0.0:
        scale = 1.0
    iterations = 0
    for attempt in (x, linear):
        if attempt is None:
            continue
        found, norm, count = newton_at(balance, condensed, linear, attempt, sliders, TOLERANCE * scale, MAX_ITERATION)
        iterations += count
        if norm <= TOLERANCE * scale:
            return finished(balance, condensed, found, sliders, norm / scale, iterations)
    for guess in (linear, 0 * linear):
        found, norm, count = _ramp(balance, condensed, guess, sliders, scale)
        iterations += count
        if norm <= TOLERANCE * scale:
            return finished(balance, condensed, found, sliders, norm / scale, iterations)
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


def _ramp(
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
    balance: HarmonicBalance, condensed: Condensed, x: Real, sliders: Start, norm: float, iterations: int
) -> SteadyState:
    """A solution with the full response recovered."""
    forces = forces_at(balance, condensed.angular_frequency, x, sliders, want=0)
    return SteadyState(
        angular_frequency=condensed.angular_frequency,
        level=balance.level,
        displacement=complex_from_real(x),
        coefficients=balance.response(condensed.angular_frequency, forces.coefficients),
        slider=sliders.value.copy(),
        multiplier=bool(sliders.by_multiplier.any()),
        # The last instant of one period precedes the first of the next.
        slider_at_start=forces.slider[:, -1].copy(),
        residual_norm=float(norm),
        iterations=iterations,
    )
