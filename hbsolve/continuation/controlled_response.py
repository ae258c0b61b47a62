"""The force that holds the amplitude of a sensor over frequency, as a response-controlled test measures it.

Under a given force a resonance with a joint has folds and several states; with the amplitude held there is usually one
state, and the curve over frequency has no folds. Its states are found in the phase in which the reading is real
(`hbsolve.continuation.controlled_amplitude`). A shift of time gives each state the phase of the given force. The joints
are then sampled at other instants, for which Newton's method with the level as a further unknown corrects the state.
"""

from collections.abc import Callable

import numpy as np

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import InitialSliders, JointForces
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.controlled_amplitude import ControlledAmplitude, Reading
from hbsolve.continuation.response import follow_to_end, make_branch
from hbsolve.continuation.step import Continuation, ContinuationState
from hbsolve.errors import NoSteadyState
from hbsolve.linearised import active_rows, transposed_jacobian
from hbsolve.newton import RELATIVE, bordered_step
from hbsolve.sampling import complex_from_real, real_from_complex
from hbsolve.solution import TOLERANCE, compute_relative_residual, forces_at, recover_state, residual, solve_at
from hbsolve.state import SteadyState, make_initial_sliders
from hbsolve.steady_state import from_many_starts
from reduction.array_type import Real, Vector
from reduction.base_excitation import BaseExcitation

#: Largest number of corrections after the shift of time, factor of a shortened correction, and the shortest one.
CORRECTIONS, SHORTEN, SHORTEST = 30, 0.5, 1e-2


@on_one_blas_thread
def controlled_response(
    balance: HarmonicBalance,
    row: int | Vector,
    amplitude: float,
    first: float,
    last: float,
    *,
    derivative: int = 0,
    base: BaseExcitation | None = None,
    step: float | None = None,
    slider: Real | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Response over frequency with the amplitude of a sensor held, and the level that holds it at each point.

    Each point is a steady state of `balance.at_level(level)`, from which `steady_state` can start.

    Parameters
    ----------
    balance
        System and its harmonics. Its force acts in harmonic 1 alone; its level is not used.
    row
        Sensor, a degree of freedom or a row over all of them, shape (r,) [-].
    amplitude
        Amplitude of the first harmonic of its reading [m, m/s or m/s^2].
    first, last
        Range of Omega, in either order [rad/s].
    derivative
        Whether it reads the displacement (0), the velocity (1) or the acceleration (2).
    base
        Motion of the base that excites the system, if the sensor reads the absolute motion; by default the sensor reads
        the motion relative to the base, or the base does not move. The level contains Omega^p of the quantity of the
        base.
    step
        Largest step [rad/s]; a fiftieth of the range by default.
    slider
        Initial slider positions, shape (s,) [m]; zero by default.
    report
        Called with the range done and the whole range.

    Raises
    ------
    BalanceError
        As `ControlledAmplitude`, and an empty range.
    NoSteadyState
        No steady state with that amplitude at the first frequency, or none under the force that a point needs.
    """
    path = ControlledAmplitude(balance=balance, row=row, amplitude=amplitude, derivative=derivative, base=base)
    continuation = make_controlled_continuation(path, first, last, step)
    sliders = make_initial_sliders(balance, slider)
    begun = begin_controlled(continuation, sliders)
    points, state, reason = follow_to_end(continuation, begun, report)
    states = [state_under_force(path, value, point.motion, sliders, point.iterations) for value, point in points]
    return make_branch([balance] * len(states), states, reason, continuation.stopped_at(state), state.leaps)


def make_controlled_continuation(
    path: ControlledAmplitude, first: float, last: float, step: float | None = None
) -> Continuation:
    """The branch of a path between two frequencies; refused (`BalanceError`) if the force does not move the sensor."""
    continuation = Continuation(path=path, first=first, last=last, step=step)
    for end in (continuation.first, continuation.last):
        path.refuse_unmoved(end)
    return continuation


def begin_controlled(
    continuation: Continuation, sliders: InitialSliders, start: Real | None = None
) -> tuple[list[tuple[float, SteadyState]], ContinuationState]:
    """The first point of a branch under control.

    Newton's method begins at a motion of the directions, shape (d, nh), or with all contacts stuck, then along a ramp
    of the amplitude and from many starts; if all of these fail, a `NoSteadyState` is raised.
    """
    balance, condensed = continuation.path.at(continuation.first)
    try:
        point = solve_at(balance, condensed, start, sliders)
    except NoSteadyState:
        result = from_many_starts(balance, condensed, start, sliders)
        if result is None:
            shown = f"{continuation.path.displayed(continuation.first):.6g} {continuation.path.unit}"
            raise NoSteadyState(f"no steady state with the controlled amplitude was found at {shown}") from None
        point = result
    return [(continuation.first, point)], continuation.state_at(point.motion, sliders)


def state_under_force(
    path: ControlledAmplitude, value: float, motion: Real, sliders: InitialSliders, iterations: int
) -> SteadyState:
    """The steady state under the given force, from its motion in the phase of the reading.

    Parameters
    ----------
    path
        Path with the held amplitude.
    value
        Omega [rad/s].
    motion
        Motion of the joint directions, shape (d, nh) [m].
    sliders
        Sliders at the first instant.
    iterations
        Number of iterations that led to the motion.

    Raises
    ------
    NoSteadyState
        The corrections after the shift of time do not converge.
    """
    reading, condensed = path.ordinary(value)
    held = path.held(value)
    level = reading.level(held, forces_at(path.balance, value, motion, sliders).coefficients)
    q = complex_from_real(motion)
    x = real_from_complex(q * np.exp(-1j * np.angle(level) * np.arange(len(q)))[:, None])
    trial = _Trial(path, reading, condensed, sliders, x, abs(level))
    count = 0
    while trial.norm > TOLERANCE:
        if count == CORRECTIONS:
            raise NoSteadyState(
                f"the steady state at {path.displayed(value):.6g} Hz, level {abs(level):g}, with the controlled "
                f"amplitude was found only to {trial.norm:.1e}"
            )
        trial, count = trial.corrected(), count + 1
    at_level = path.balance.at_level(trial.level)
    return recover_state(at_level, condensed, trial.motion, sliders, trial.unbalance, iterations + count)


class _Trial:
    """A motion and a level of the force, and their errors in the balance and in the held amplitude."""

    def __init__(
        self,
        path: ControlledAmplitude,
        reading: Reading,
        condensed: Condensed,
        sliders: InitialSliders,
        motion: Real,
        level: float,
    ) -> None:
        self.path, self.reading, self.condensed, self.sliders = path, reading, condensed, sliders
        self.motion, self.level = motion, level
        self.balance = path.balance.at_level(level)
        self.forces: JointForces = forces_at(self.balance, condensed.angular_frequency, motion, sliders)
        self.residual = residual(self.balance, condensed, motion, self.forces)
        g = complex_from_real(self.forces.coefficients)[1]
        self.read = complex(level * reading.driven - reading.receptance @ g)
        self.held = path.held(condensed.angular_frequency)
        self.unbalance = compute_relative_residual(self.balance, condensed, motion, self.forces, self.residual)
        self.norm = max(self.unbalance, abs(abs(self.read) / self.held - 1))

    def corrected(self) -> "_Trial":
        """Trial after one step of Newton's method, shortened if the error grows."""
        dx, by_level = self._step()
        share, best = 1.0, self._at(dx, by_level)
        while best.norm >= self.norm and share > SHORTEST:
            share *= SHORTEN
            trial = self._at(share * dx, share * by_level)
            best = trial if trial.norm < best.norm else best
        return best

    def _at(self, dx: Real, by_level: float) -> "_Trial":
        moved = self.motion + dx, self.level + by_level
        return _Trial(self.path, self.reading, self.condensed, self.sliders, *moved)

    def _step(self) -> tuple[Real, float]:
        """Step of the motion and of the level."""
        first, count = self.balance.joint_of_direction
        turned = np.conj(self.read) / abs(self.read)
        # d|y| = Re(turned (D dlevel - C^T dg_1)), with g_1 = cosine - i sine.
        by_force = np.zeros_like(self.residual)
        by_force[:, 1], by_force[:, 2] = (
            (turned * self.reading.receptance).real,
            (turned * self.reading.receptance).imag,
        )
        rows = active_rows(self.forces.active)
        by_motion = transposed_jacobian(rows, self.forces.jacobian, first, count, by_force[rows[:, 0], rows[:, 1]])
        dx, by_level = bordered_step(
            self.forces, self.condensed.columns, first, count, self.residual,
            -real_from_complex(self.condensed.dynamic), -by_motion,
            float((turned * self.reading.driven).real), abs(self.read) - self.held, RELATIVE,
        )  # fmt: skip
        return dx, float(by_level)
