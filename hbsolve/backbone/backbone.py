"""Backbone of a mode: frequency, damping ratio and shape against amplitude, by continuation over the amplitude."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Complex, Float

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import InitialSliders
from hbsolve.backbone.modal_balance import ModalBalance, ModalEquation, ModalUnknowns
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError, NoSteadyState
from hbsolve.joint_law.registry import FORCE
from hbsolve.solution import forces_at
from hbsolve.state import harmonic_at, make_initial_sliders
from reduction.array_input import check_real_number, check_whole_number, freeze_arrays
from reduction.array_type import Array, Real

#: |R| over the motion, and |S| over the mode's own term, of a solution; largest number of Newton iterations.
TOLERANCE, ITERATIONS = 1e-9, 12
#: First, largest and smallest step in ln a, or in the relative change of the motion; largest number of points.
FIRST, LARGEST, LEAST, MOST_POINTS = 0.1, 0.25, 1e-6, 2000
#: A step of so many iterations or fewer grows by GROW; a step without a solution shrinks by SHRINK.
EASY, GROW, SHRINK = 4, 1.5, 0.4

#: Asymmetry of the damping, relative to its largest entry, that counts as round-off.
ASYMMETRY = 1e-9
#: Natural frequency over the highest one below which a mode is a rigid-body motion.
RIGID = 1e-7

Numbers = Float[Real, " p"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Backbone:
    """A nonlinear mode at p amplitudes; arrays are copied and read-only."""

    amplitude: Numbers
    """a: fundamental of the linear mode, with all contacts stuck and closed, mass-normalised, shape (p,) [m kg^1/2]."""
    angular_frequency: Numbers
    """omega, shape (p,) [rad/s]."""
    damping_ratio: Numbers
    """zeta of -2 zeta omega M, which balances the dissipation, shape (p,) [-]."""
    coefficients: Complex[Array, "p harmonic r"]
    """Motion in the convention of `hbsolve.fourier`, shape (p, H + 1, r) [m]."""
    modal_mass: Numbers
    """q_1^H M q_1, equal to a^2 where the shape does not change, shape (p,) [m^2 kg]."""
    complete: bool
    """Whether the largest amplitude was reached; otherwise no step was short enough, the points were too many, or the
    mode turned back."""
    slider: Float[Real, "p s"] = field(default_factory=lambda: np.zeros((0, 0)))
    """Sliders at the start of the period, shape (p, s) [m]."""

    def __post_init__(self) -> None:
        freeze_arrays(self, "coefficients", dtype=np.complex128)
        freeze_arrays(self, "amplitude", "angular_frequency", "damping_ratio", "modal_mass", "slider")

    @property
    def frequency(self) -> Numbers:
        """Frequency of the mode, shape (p,) [Hz]."""
        return np.asarray(self.angular_frequency / (2 * np.pi))

    def displacement(self, row: int | Float[Real, " r"], harmonic: int = 1) -> Numbers:
        """Amplitude of one harmonic of a degree of freedom, or of a row over all of them, shape (p,) [m].

        Raises
        ------
        BalanceError
            A harmonic or a degree of freedom that the backbone does not have, or a row of another size.
        """
        return np.asarray(np.abs(harmonic_at(self.coefficients, row, harmonic)))

    def level(self, force: Complex[Array, " r"]) -> Numbers:
        r"""Level of a force in the fundamental at which the forced response passes each point, shape (p,) [-].

        At phase resonance the work of the force equals the dissipation of the nonlinear mode,
        :math:`|q_1^H f_1| = 2 \zeta \omega^2 q_1^H M q_1`. The level is exact for a force in the shape of the inertia
        where higher harmonics do no work, and nearly exact where the mode is well separated from its neighbours.

        Parameters
        ----------
        force
            Coefficients of harmonic 1 at level 1, shape (r,) [N].

        Raises
        ------
        BalanceError
            A force of another size.
        """
        wanted = self.coefficients.shape[2]
        if np.shape(force) != (wanted,):
            raise BalanceError(f"the force has shape {np.shape(force)}: give {wanted} coefficients of harmonic 1")
        work = np.abs(self.coefficients[:, 1].conj() @ np.asarray(force))
        with np.errstate(divide="ignore"):
            return np.asarray(2 * np.abs(self.damping_ratio) * self.angular_frequency**2 * self.modal_mass / work)


@on_one_blas_thread
def backbone(
    balance: HarmonicBalance,
    mode: int,
    first: float,
    last: float,
    *,
    step: float = LARGEST,
    slider: Sequence[float] | Real | None = None,
    report: Callable[[float, float], None] | None = None,
) -> Backbone:
    """Follow a nonlinear mode over its amplitude, round folds of internal resonances.

    Parameters
    ----------
    balance
        System and harmonics.
    mode
        Number of the mode with all contacts stuck and closed, from 1 on, by frequency.
    first, last
        Smallest and largest amplitude a [m kg^1/2]: a displacement over that of the mass-normalised shape.
    step
        Largest step in ln a, or in the relative change of the motion; a quarter by default [-].
    slider
        Sliders at the first instant, shape (s,) [m]; zero by default.
    report
        Called with the range of ln a done and the whole range.

    Raises
    ------
    BalanceError
        A mode that does not exist or is a rigid-body motion, amplitudes that are not positive and ascending, a step
        that is not larger than the smallest one, no fundamental, or damping that is not symmetric.
    NoSteadyState
        No periodic motion at the first amplitude: begin with a smaller one.

    References
    ----------
    Krack, Nonlinear modal analysis of nonconservative systems, Computers and Structures 154 (2015).
    """
    number = check_whole_number(mode, "mode", BalanceError)
    if not 1 <= number <= balance.system.n_dof:
        raise BalanceError(f"there is no mode {number}: the structure has 1 to {balance.system.n_dof}")
    first, last = check_real_number(first, "first", BalanceError), check_real_number(last, "last", BalanceError)
    if not 0 < first < last < np.inf:
        raise BalanceError(f"the amplitudes from {first:g} to {last:g} must be positive and ascending")
    if not LEAST < check_real_number(step, "step", BalanceError) < np.inf:
        raise BalanceError(f"step = {step:g} must be finite and larger than {LEAST:g}")
    if balance.n_harmonic < 2:
        raise BalanceError("n_harmonic = 1 is only the mean: a mode needs its fundamental, n_harmonic = 2 or more")
    if (
        np.abs(balance.system.damping - balance.system.damping.T).max()
        > ASYMMETRY * np.abs(balance.system.damping).max()
    ):
        raise BalanceError("the damping is not symmetric: backbones of gyroscopic structures are not computed")
    continuation = _BackboneContinuation(
        ModalBalance(balance, number - 1), make_initial_sliders(balance, slider), float(np.log(last)), step
    )
    points = continuation.follow(float(np.log(first)), report)
    return continuation.result(points)


class _BackboneContinuation:
    """Continuation of a backbone curve in the logarithm of the amplitude."""

    def __init__(self, modal: ModalBalance, sliders: InitialSliders, last: float, longest: float) -> None:
        self.modal, self.sliders, self.last, self.longest = modal, sliders, last, longest

    def follow(self, first: float, report: Callable[[float, float], None] | None) -> list[ModalUnknowns]:
        """Points from ln a = `first` on."""
        here, equation = self._begin(first)
        points, step, t = [here], min(FIRST, self.longest), None
        while points[-1].log_amplitude < self.last and len(points) < MOST_POINTS and step > LEAST:
            t = self._tangent(here, equation, t)
            ahead = min(step, max((self.last - here.log_amplitude) / t[3], LEAST)) if t[3] > 0 else step
            start = ModalUnknowns(
                here.motion + ahead * t[0], here.angular_frequency + ahead * t[1], here.damping_ratio + ahead * t[2],
                here.log_amplitude + ahead * t[3],
            )  # fmt: skip
            result = self._correct(start, (t[0] / self._size(here) ** 2, t[3]))
            if result is None:
                step *= SHRINK
                continue
            here, equation, iterations = result
            points.append(here)
            if iterations <= EASY:
                step = min(GROW * step, self.longest)
            if report is not None:
                report(max(here.log_amplitude - first, 0.0), self.last - first)
            if here.log_amplitude < first:
                break
        return points

    def result(self, points: list[ModalUnknowns]) -> Backbone:
        """Points as a backbone."""
        modal, balance = self.modal, self.modal.balance
        forces = [forces_at(balance, item.angular_frequency, item.motion, self.sliders, want=FORCE) for item in points]
        coefficients = np.array([modal.response(item, force) for item, force in zip(points, forces, strict=True)])
        fundamental = coefficients[:, 1]
        return Backbone(
            amplitude=np.array([item.amplitude for item in points]),
            angular_frequency=np.array([item.angular_frequency for item in points]),
            damping_ratio=np.array([item.damping_ratio for item in points]),
            coefficients=coefficients,
            modal_mass=np.einsum("pr,pr->p", fundamental.conj(), fundamental @ balance.system.mass).real,
            slider=np.array([force.slider[:, -1] for force in forces]),
            complete=points[-1].log_amplitude >= self.last * (1 - 1e-12) - 1e-9,
        )

    def _begin(self, first: float) -> tuple[ModalUnknowns, ModalEquation]:
        modal, m = self.modal, self.modal.mode
        omega = float(np.sqrt(max(modal.modes.eigenvalue[m], 0.0)))
        if omega <= RIGID * float(np.sqrt(modal.modes.eigenvalue[-1])):
            raise BalanceError(f"mode {m + 1} is a rigid-body motion, which has no frequency: choose a higher mode")
        zeta = float(modal.modes.damping[m, m]) / (2 * omega)
        linear = modal.linear(omega, zeta)
        start = ModalUnknowns(modal.rest + np.exp(first) * modal.fundamental(linear.by_amplitude), omega, zeta, first)
        result = self._correct(start, (np.zeros_like(modal.rest), 1.0))
        if result is None:
            raise NoSteadyState(
                f"no periodic motion of mode {m + 1} was found at the amplitude {np.exp(first):.3g} m kg^1/2: "
                "Newton's method from the linear mode did not converge; begin with a smaller amplitude"
            )
        return result[0], result[1]

    def _size(self, at: ModalUnknowns) -> float:
        """Size of the vibration, to which changes of the motion are relative [m]."""
        return float(np.linalg.norm(at.motion - self.modal.rest)) or 1.0

    def _tangent(
        self, at: ModalUnknowns, equation: ModalEquation, last: tuple[Real, float, float, float] | None
    ) -> tuple[Real, float, float, float]:
        """Tangent of length 1 in the motion and ln a, in the direction of travel."""
        border = (np.zeros_like(at.motion), 1.0) if last is None else (last[0] / self._size(at) ** 2, last[3])
        moved, change = self._step(at, equation, border, 0 * equation.residual, 0j, -1.0)
        length = float(np.hypot(np.linalg.norm(moved) / self._size(at), change[2]))
        omega, zeta, log_amplitude = (float(value) / length for value in change)
        return moved / length, omega, zeta, log_amplitude

    def _correct(
        self, start: ModalUnknowns, border: tuple[Real, float]
    ) -> tuple[ModalUnknowns, ModalEquation, int] | None:
        """Newton's method in the plane perpendicular to the border."""
        at = start
        for iteration in range(ITERATIONS + 1):
            if not (at.angular_frequency > 0 and np.isfinite(at.motion).all() and np.isfinite(at.damping_ratio)):
                return None
            equation = self.modal.evaluate(at, self.sliders)
            error = max(float(np.linalg.norm(equation.residual)) / self._size(at), abs(equation.modal))
            if error <= TOLERANCE:
                return at, equation, iteration
            distance = float((border[0] * (at.motion - start.motion)).sum())
            distance += border[1] * (at.log_amplitude - start.log_amplitude)
            moved, change = self._step(at, equation, border, equation.residual, equation.modal, distance)
            at = ModalUnknowns(
                at.motion + moved, at.angular_frequency + float(change[0]), at.damping_ratio + float(change[1]),
                at.log_amplitude + float(change[2]),
            )  # fmt: skip
            if abs(at.log_amplitude - start.log_amplitude) > 1.0:
                return None
        return None

    def _step(
        self,
        at: ModalUnknowns,
        equation: ModalEquation,
        border: tuple[Real, float],
        residual: Real,
        modal: complex,
        distance: float,
    ) -> tuple[Real, Float[Real, "3"]]:
        """Newton's step in the motion and in omega, zeta, ln a, by elimination of the motion."""
        own = -self.modal.solve(equation, residual)
        by = [-self.modal.solve(equation, column) for column in equation.by]
        seen = [self.modal.modal_change(at, equation, item) for item in (own, *by)]
        modal_by = equation.modal_by + np.array(seen[1:])
        along = np.array([float((border[0] * item).sum()) for item in (own, *by)])
        along[3] += border[1]
        matrix = np.array([modal_by.real, modal_by.imag, along[1:]])
        right = -np.array([(modal + seen[0]).real, (modal + seen[0]).imag, distance + along[0]])
        # Omega is orders of magnitude larger than the others.
        scale = np.array([at.angular_frequency, 1.0, 1.0])
        change = scale * np.linalg.solve(matrix * scale, right)
        moved = own + sum(value * item for value, item in zip(change, by, strict=True))
        return moved, change
