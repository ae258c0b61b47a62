r"""The balance of a nonlinear mode: periodic motion without a harmonic force, maintained by an artificial damping.

The extended periodic motion concept (EPMC) gives the structure the damping -2 zeta omega M, which supplies the energy
that friction and dampers dissipate,

.. math:: \left( \Lambda - (k \omega)^2 + i k \omega (C_m - 2 \zeta \omega) \right) \eta_k = -\Phi^T B^T g_k
          + \delta_{k0}\, \Phi^T f_\mathrm{static} ,

in the modes of the linear reference. The fundamental of the mode to be followed has the real amplitude a, which sets
the phase. Its own equation determines omega and zeta; all others give, for the joint directions,

.. math:: R = x - x_\mathrm{static} - a\, b + A\, g(x) = 0, \qquad S = s\, a + b_1 \cdot g_1 = 0 ,

with A without this mode in the fundamental: no receptance is singular at the resonance. b is the motion of the
directions per amplitude, and s the dynamic stiffness of the mode. Coupling by damping is eliminated in both.

References
----------
Krack, Nonlinear modal analysis of nonconservative systems, Computers and Structures 154 (2015).
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from hbsolve.aft import InitialSliders, JointForces
from hbsolve.balance import HarmonicBalance
from hbsolve.fourier import Coefficients
from hbsolve.joint_law.registry import PARAMETERS
from hbsolve.linear_modes import compute_linear_modes
from hbsolve.linearised import active_rows, scattered, times_jacobian
from hbsolve.newton import apply_receptance, newton_step
from hbsolve.sampling import complex_from_real, real_from_complex
from hbsolve.solution import forces_at
from reduction.array_type import Array, Real, Whole

#: Relative step of the differences of receptances in omega, and step in zeta: their errors only slow Newton's method.
STEP = 1e-6


class ModalUnknowns(NamedTuple):
    """A point of the backbone."""

    motion: Real
    """Real coefficients of the joint directions, shape (d, nh) [m]."""
    angular_frequency: float
    """omega [rad/s]."""
    damping_ratio: float
    """zeta [-]."""
    log_amplitude: float
    """ln of a [m kg^1/2]."""

    @property
    def amplitude(self) -> float:
        """Amplitude a [m kg^1/2]."""
        return float(np.exp(self.log_amplitude))


class Linear(NamedTuple):
    """Linear terms of the equations at one omega and zeta."""

    columns: Complex[Array, "harmonic d d"]
    """Columns of A, one in each row [m/N]."""
    by_amplitude: Complex[Array, " d"]
    """b, in the fundamental, shape (d,) [kg^-1/2]."""
    stiffness: complex
    """s [1/s^2]."""


class ModalEquation(NamedTuple):
    """R and S at a point, and their derivatives for Newton's method."""

    residual: Real
    """R, shape (d, nh) [m]."""
    modal: complex
    """S over a and the mode's eigenvalue [-]."""
    forces: JointForces
    linear: Linear
    by: Float[Real, "3 d nh"]
    """Derivatives of R by omega, zeta and ln a."""
    modal_by: Complex[Array, "3"]
    """Derivatives of the scaled S by the same."""


class ModalBalance:
    """The balance of one mode.

    Parameters
    ----------
    balance
        System and harmonics; its level is not used.
    mode
        Number of the mode of the linear reference, from 0 on.
    """

    def __init__(self, balance: HarmonicBalance, mode: int) -> None:
        self.balance, self.mode, self.modes = balance, mode, compute_linear_modes(balance)
        self.others = np.delete(np.arange(len(self.modes.eigenvalue)), mode)
        self.static = self.modes.shapes.T @ balance.structure.static[0].real / self.modes.eigenvalue
        self.rest = np.zeros((balance.n_direction, 2 * balance.n_harmonic - 1))
        self.rest[:, 0] = self.modes.rows @ self.static

    def linear(self, angular_frequency: float, damping_ratio: float) -> Linear:
        """A, b and s."""
        rows, others, n_harmonic = self.modes.rows, self.others, self.balance.n_harmonic
        columns = np.empty((n_harmonic, len(rows), len(rows)), dtype=np.complex128)
        for k in range(n_harmonic):
            kept = others if k == 1 else np.arange(rows.shape[1])
            Z = self._dynamic(k, angular_frequency, damping_ratio)
            columns[k] = (rows[:, kept] @ _solve(Z, kept, rows[:, kept].T.astype(np.complex128))).T
        Z = self._dynamic(1, angular_frequency, damping_ratio)
        if Z.ndim == 1:
            return Linear(columns, rows[:, self.mode].astype(np.complex128), complex(Z[self.mode]))
        moved = _solve(Z, others, Z[others, self.mode])
        along = rows[:, self.mode] - rows[:, others] @ moved
        return Linear(columns, along, complex(Z[self.mode, self.mode] - Z[self.mode, others] @ moved))

    def evaluate(self, at: ModalUnknowns, sliders: InitialSliders) -> ModalEquation:
        """R, S and their derivatives at a point."""
        omega, zeta = at.angular_frequency, at.damping_ratio
        forces = forces_at(self.balance, omega, at.motion, sliders, want=PARAMETERS)
        linear = self.linear(omega, zeta)
        residual, modal = self._equations(at, linear, forces)
        by, modal_by = [], []
        for d_omega, d_zeta in ((STEP * omega, 0.0), (0.0, STEP)):
            (up, modal_up), (down, modal_down) = (
                self._equations(at, self.linear(omega + sign * d_omega, zeta + sign * d_zeta), forces)
                for sign in (1, -1)
            )
            by.append((up - down) / (2 * (d_omega + d_zeta)))
            modal_by.append((modal_up - modal_down) / (2 * (d_omega + d_zeta)))
        by[0] = by[0] + apply_receptance(linear.columns, forces.by_frequency)
        modal_by[0] += self._scale(at) * complex(linear.by_amplitude @ complex_from_real(forces.by_frequency)[1])
        by.append(-at.amplitude * self.fundamental(linear.by_amplitude))
        modal_by.append(self._scale(at) * linear.stiffness * at.amplitude)
        return ModalEquation(residual, modal, forces, linear, np.array(by), np.array(modal_by))

    def solve(self, equation: ModalEquation, right: Real) -> Real:
        """(I + A L)^-1 of a motion."""
        first, count = self.balance.joint_of_direction
        right = np.ascontiguousarray(right)
        solved: Real = newton_step(equation.forces, equation.linear.columns, first, count, right, 0.0)
        return solved

    def modal_change(self, at: ModalUnknowns, equation: ModalEquation, moved: Real) -> complex:
        """Change of the scaled S by a change of the motion."""
        first, count = self.balance.joint_of_direction
        rows = active_rows(equation.forces.active)
        if not len(rows):
            return 0j
        change = times_jacobian(rows, equation.forces.jacobian, first, count, np.ascontiguousarray(moved))
        force = complex_from_real(scattered(rows, change, *moved.shape))
        return self._scale(at) * complex(equation.linear.by_amplitude @ force[1])

    def response(self, at: ModalUnknowns, forces: JointForces) -> Coefficients:
        """Coefficients of all degrees of freedom, shape (H + 1, r) [m]."""
        modes, others = self.modes, self.others
        modal_force = -complex_from_real(forces.coefficients) @ modes.rows
        eta = np.zeros((self.balance.n_harmonic, len(modes.eigenvalue)), dtype=np.complex128)
        eta[0] = self.static + modal_force[0].real / modes.eigenvalue
        for k in range(1, len(eta)):
            Z = self._dynamic(k, at.angular_frequency, at.damping_ratio)
            if k > 1:
                eta[k] = _solve(Z, np.arange(len(modes.eigenvalue)), modal_force[k])
                continue
            eta[1, self.mode] = at.amplitude
            coupling = 0.0 if Z.ndim == 1 else Z[others, self.mode]
            eta[1, others] = _solve(Z, others, modal_force[1, others] - coupling * at.amplitude)
        return np.asarray(eta @ modes.shapes.T)

    def _dynamic(self, k: int, angular_frequency: float, damping_ratio: float) -> Array:
        """Dynamic stiffness of the modes in harmonic k: its diagonal, shape (r,), where they uncouple, or (r, r)."""
        w, fed = k * angular_frequency, 2 * damping_ratio * angular_frequency
        own = self.modes.eigenvalue - w**2 - 1j * w * fed
        if self.modes.is_diagonal:
            return np.asarray(own + 1j * w * np.diag(self.modes.damping))
        return np.asarray(np.diag(own) + 1j * w * self.modes.damping)

    def _equations(self, at: ModalUnknowns, linear: Linear, forces: JointForces) -> tuple[Real, complex]:
        """R, and S over a and the eigenvalue of the mode."""
        R = at.motion - self.rest - at.amplitude * self.fundamental(linear.by_amplitude)
        S = linear.stiffness * at.amplitude + complex(linear.by_amplitude @ complex_from_real(forces.coefficients)[1])
        return R + apply_receptance(linear.columns, forces.coefficients), self._scale(at) * S

    def _scale(self, at: ModalUnknowns) -> float:
        return 1 / (at.amplitude * float(self.modes.eigenvalue[self.mode]))

    def fundamental(self, values: Complex[Array, " d"]) -> Real:
        """A motion in the fundamental alone, as real coefficients."""
        series = np.zeros((self.balance.n_harmonic, self.balance.n_direction), dtype=np.complex128)
        series[1] = values
        return real_from_complex(series)


def _solve(Z: Array, kept: Int[Whole, " k"], right: Array) -> Array:
    """Z^-1 of columns, for the modes that are kept."""
    if Z.ndim == 1:
        return np.asarray(right / (Z[kept][:, None] if right.ndim == 2 else Z[kept]))
    return np.asarray(np.linalg.solve(Z[np.ix_(kept, kept)], right))
