r"""Derivatives of a steady state by the implicit function theorem, exact and without another solution.

A change dp of a parameter changes the loads and the joint forces at fixed motion by df and dg, and the motion by

.. math:: (I + A L)\, dx = B \alpha\, df - A\, dg, \qquad dq = \alpha \left( df - B^T (L\, dx + dg) \right) .

References
----------
Petrov, Mech. Syst. Signal Process. 23 (2009): sensitivities of friction-damped structures.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import JointForces
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.continuation.continuation_parameter import find_joint_index, spread
from hbsolve.errors import BalanceError
from hbsolve.fourier import Coefficients
from hbsolve.joint_law.registry import PARAMETERS
from hbsolve.linearised import active_rows, small_matrix, times_jacobian, transposed_jacobian
from hbsolve.model_rates import MatrixParameter, ModelParameter, ModelRates, check_entries
from hbsolve.sampling import complex_from_real, real_from_complex
from hbsolve.solution import forces_at
from hbsolve.state import SteadyState, check_harmonic, check_state
from reduction.array_input import check_finite_number, check_whole_number
from reduction.array_type import Array, Real, Row, Whole


@dataclass(frozen=True, kw_only=True)
class JointParameter:
    """A field of a joint, such as "friction_coefficient" or "gap", in its SI unit."""

    joint: str
    name: str


@dataclass(frozen=True, kw_only=True)
class SliderParameter:
    """The start of one slider [m], or its multiplier of eq. 11 if the state was found with multipliers."""

    slider: int


@dataclass(frozen=True, kw_only=True)
class LevelParameter:
    """The level of the harmonic force."""


@dataclass(frozen=True, kw_only=True)
class FrequencyParameter:
    """Omega [rad/s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadParameter:
    """The size of a force along a row, in one harmonic [N]."""

    row: Row
    """Weights of the degrees of freedom, shape (r,) [-]."""
    harmonic: int = 1
    """Harmonic k; 0 for a static force."""
    phase: float = 0.0
    """Phase of the force, e^{i (k Omega t + phase)} [rad]."""


Parameter = (
    JointParameter
    | SliderParameter
    | LevelParameter
    | FrequencyParameter
    | LoadParameter
    | MatrixParameter
    | ModelParameter
)


def point_mass(row: Row) -> MatrixParameter:
    """A mass that moves with the displacement of a row [kg]."""
    return MatrixParameter(mass=np.outer(row, row))


def spring(row: Row) -> MatrixParameter:
    """A spring that the displacement of a row stretches [N/m]."""
    return MatrixParameter(stiffness=np.outer(row, row))


def damper(row: Row) -> MatrixParameter:
    """A dashpot that the velocity of a row works on [N s/m]."""
    return MatrixParameter(damping=np.outer(row, row))


def scaled(balance: HarmonicBalance, *names: str) -> MatrixParameter:
    """A common factor on "mass", "damping" or "stiffness", such as both of the latter for Young's modulus [-].

    Raises
    ------
    BalanceError
        Another name.
    """
    for name in names:
        if name not in {"mass", "damping", "stiffness"}:
            raise BalanceError(f'there is no matrix "{name}" to scale: give mass, damping or stiffness')
    return MatrixParameter(**{name: getattr(balance.system, name) for name in names})


@on_one_blas_thread
def sensitivity(
    balance: HarmonicBalance, state: SteadyState, parameters: Sequence[Parameter]
) -> Complex[Array, "parameter harmonic r"]:
    """Derivative of all coefficients with respect to each parameter, shape (n_parameter, H + 1, r) [m / its unit].

    Parameters
    ----------
    balance
        Balance with which the state was found.
    state
        Converged state; at a kink (a contact about to change) the derivative is that of one side.
    parameters
        Parameters of the derivatives.

    Raises
    ------
    BalanceError
        A joint, parameter, slider or harmonic that the system does not have, a row or a matrix of another size or
        without finite numbers, or a state of another balance.
    """
    if isinstance(parameters, Parameter):
        raise BalanceError(f"the parameters are one {type(parameters).__name__}: give a list of parameters")
    check_state(balance, state)
    at_level = balance.at_level(state.level)
    condensed = at_level.at(state.angular_frequency)
    forces = forces_at(at_level, state.angular_frequency, state.motion, state.sliders, want=PARAMETERS)
    loads = np.zeros((len(parameters), *state.coefficients.shape), dtype=np.complex128)
    g = np.zeros((len(parameters), *forces.coefficients.shape))
    for number, parameter in enumerate(parameters):
        loads[number], g[number] = _change(at_level, state, forces, parameter)
    reaction = _compute_reaction(at_level, condensed, forces, loads, g)
    return at_level.structure.displacements(condensed, loads - reaction @ at_level.structure.directions)


class ReadingResponse(NamedTuple):
    """Response of n readings to loads, each one harmonic of a sensor."""

    harmonic: Int[Whole, " n"]
    """Shape (n,) [-]."""
    load: Complex[Array, "n r"]
    """The reading under a unit load on each degree of freedom, with all contacts stuck, shape (n, r)."""
    reaction: Complex[Array, "n d"]
    """The reading under a unit joint force beyond D x, at fixed motion of the joints, shape (n, d)."""
    motion: Complex[Array, "n d"]
    """The reading under a unit motion of the joints, shape (n, d)."""

    def weigh_by_harmonic(self, weights: Complex[Array, "n m"], n_harmonic: int) -> Complex[Array, "2*n harmonic m"]:
        """Weights w of the real parts Re(w q), and then of the imaginary parts Re(-i w q), of readings, by harmonic."""
        n = len(weights)
        parts = np.zeros((2, n, n_harmonic, weights.shape[1]), dtype=np.complex128)
        parts[0, np.arange(n), self.harmonic] = weights
        parts[1, np.arange(n), self.harmonic] = -1j * weights
        return parts.reshape(2 * n, *parts.shape[2:])


def derivatives(
    balance: HarmonicBalance,
    state: SteadyState,
    forces: JointForces,
    rates: ModelRates,
    condensed: Condensed,
    contact: Complex[Array, "harmonic r d"],
    response: ReadingResponse,
) -> Complex[Array, "n p"]:
    """Derivatives of n readings by p parameters of a model, shape (n, p), by the adjoint of the equations above.

    The adjoint takes one solution per reading, for all loads; there are fewer readings than parameters.

    Parameters
    ----------
    balance
        Balance at the level of the state.
    state, forces, rates
        State of this balance, the forces of its joints with their derivatives, and parameters.
    condensed, contact
        The structure at the state's Omega, and its motion under a unit force along each joint direction.
    response
        Response of the readings at the state's Omega.
    """
    loads, g = rates.loads(state), rates.forces(balance, forces.by_parameter)
    n_harmonic, A = len(condensed.static), condensed.receptance
    # A joint force also moves the joints: dx = B alpha df - A dg.
    own, moving = response.reaction.copy(), response.motion.any(axis=1)
    own[moving] -= (response.motion[moving, None] @ A[response.harmonic[moving]])[:, 0]
    by_motion, by_reaction = (
        response.weigh_by_harmonic(response.motion, n_harmonic),
        response.weigh_by_harmonic(own, n_harmonic),
    )
    first, count = balance.joint_of_direction
    rows = active_rows(forces.active)
    if len(rows):
        matrix = small_matrix(rows, forces.jacobian, first, count, condensed.columns, 2 * n_harmonic - 1)
        weights = real_from_complex(by_reaction.conj())[:, rows[:, 0], rows[:, 1]]
        solved = np.linalg.solve(matrix.T, weights.T).T
        turned = np.array([transposed_jacobian(rows, forces.jacobian, first, count, item) for item in solved])
        by_slip = complex_from_real(turned).conj()
        by_motion += by_slip
        by_reaction -= _multiply_by_harmonic(by_slip, A)
    by_load = response.weigh_by_harmonic(response.load, n_harmonic) + _multiply_by_harmonic(
        by_motion, contact.swapaxes(1, 2)
    )
    reaction = real_from_complex(by_reaction.conj())
    result = _compute_real_products(loads, by_load) + np.tensordot(reaction, g, axes=((1, 2), (1, 2)))
    return np.asarray(result[: len(result) // 2] + 1j * result[len(result) // 2 :])


def _multiply_by_harmonic(weights: Complex[Array, "n harmonic m"], matrix: Array) -> Complex[Array, "n harmonic k"]:
    """Products with the matrix of each harmonic, shape (H + 1, m, k)."""
    return np.asarray(np.matmul(weights.swapaxes(0, 1), matrix).swapaxes(0, 1))


def _compute_real_products(
    changes: Complex[Array, "p harmonic m"], weights: Complex[Array, "n harmonic m"]
) -> Float[Real, "n p"]:
    """Re(w q), summed over harmonics and columns, shape (n, p)."""
    size = changes[0].size if len(changes) else weights[0].size if len(weights) else 0
    q, w = changes.reshape(len(changes), size), weights.reshape(len(weights), size)
    return np.asarray(w.real @ q.real.T - w.imag @ q.imag.T)


def _compute_reaction(
    balance: HarmonicBalance,
    condensed: Condensed,
    forces: JointForces,
    loads: Complex[Array, "p harmonic r"],
    g: Float[Real, "p d nh"],
) -> Complex[Array, "p harmonic d"]:
    """Change of the joint forces beyond D x, L dx + dg, which moves the structure together with the loads."""
    structure, dg = balance.structure, complex_from_real(g)
    first, count = balance.joint_of_direction
    rows = active_rows(forces.active)
    if len(rows) == 0 or len(loads) == 0:
        return dg
    moved = structure.displacements(condensed, loads) @ structure.directions.T
    right = real_from_complex(moved - _multiply_by_harmonic(dg, condensed.columns))
    matrix = small_matrix(rows, forces.jacobian, first, count, condensed.columns, right.shape[2])
    right_forces = np.array([times_jacobian(rows, forces.jacobian, first, count, item) for item in right])
    force_change = np.zeros_like(right)
    force_change[:, rows[:, 0], rows[:, 1]] = np.linalg.solve(matrix, right_forces.T).T
    return complex_from_real(force_change) + dg


def _change(
    balance: HarmonicBalance, state: SteadyState, forces: JointForces, parameter: Parameter
) -> tuple[Coefficients, Real]:
    """Change of loads and of joint forces at fixed motion, shapes (H + 1, r) and (d, nh)."""
    load, g = np.zeros_like(state.coefficients), np.zeros_like(forces.coefficients)
    if isinstance(parameter, JointParameter):
        joint, index = find_joint_index(balance, parameter.joint, parameter.name)
        g = spread(balance, joint, forces.by_parameter[index])
    elif isinstance(parameter, SliderParameter):
        slider = check_whole_number(parameter.slider, "slider", BalanceError)
        if not 0 <= slider < balance.n_slider:
            raise BalanceError(f"there is no slider {slider}: the system has {balance.n_slider}")
        joint = int(np.searchsorted(balance.table.slider, slider, side="right")) - 1
        g = spread(balance, joint, forces.by_start[slider])
    elif isinstance(parameter, LevelParameter):
        load = balance.structure.dynamic.copy()
    elif isinstance(parameter, LoadParameter):
        harmonic = check_harmonic(parameter.harmonic, balance.n_harmonic)
        phase = check_finite_number(parameter.phase, "phase", BalanceError)
        row = check_entries(parameter.row, "the row of a load parameter", (balance.system.n_dof,))
        load[harmonic] = np.exp(1j * phase * (harmonic > 0)) * row
    elif isinstance(parameter, MatrixParameter):
        load = ModelRates.from_parameters(balance, [ModelParameter(matrices=parameter)]).loads(state)[0]
    elif isinstance(parameter, ModelParameter):
        rates = ModelRates.from_parameters(balance, [parameter])
        load, g = rates.loads(state)[0], rates.forces(balance, forces.by_parameter)[0]
    elif isinstance(parameter, FrequencyParameter):
        load, g = _compute_frequency_load(balance, state), forces.by_frequency
    else:
        raise BalanceError(
            f"{parameter!r} is not a parameter: give a JointParameter, a LoadParameter or another of these"
        )
    return load, np.ascontiguousarray(g)


def _compute_frequency_load(balance: HarmonicBalance, state: SteadyState) -> Coefficients:
    q, k = state.coefficients, np.arange(len(state.coefficients))[:, None]
    inertia = 2 * k**2 * state.angular_frequency * (q @ balance.system.mass.T)
    return np.asarray(inertia - 1j * k * (q @ balance.system.damping.T))
