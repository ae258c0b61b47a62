r"""Derivatives of a steady state by the implicit function theorem, exact and without another solution.

A change dp of a parameter changes the loads and the joint forces at fixed motion by df and dg; the motion answers with

.. math:: (I + A L)\, dx = B \alpha\, df - A\, dg, \qquad dq = \alpha \left( df - B^T (L\, dx + dg) \right) .

References
----------
Petrov, Mech. Syst. Signal Process. 23 (2009): sensitivities of friction-damped structures.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import JointForces
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed, Recovery
from hbsolve.continuation.continuation_parameter import joint_index, spread
from hbsolve.errors import BalanceError
from hbsolve.fourier import Coefficients
from hbsolve.joint_law.registry import PARAMETERS
from hbsolve.linearised import active_rows, small_matrix, times_jacobian
from hbsolve.model_rates import MatrixParameter, ModelParameter, ModelRates, entries
from hbsolve.sampling import complex_from_real, real_from_complex
from hbsolve.solution import forces_at
from hbsolve.state import SteadyState, check_state, checked_harmonic
from reduction.array_input import finite_number, whole_number
from reduction.array_type import Array, Real, Row


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
    """Shape (r,) [-]."""
    harmonic: int = 1
    """0 for a static force."""
    phase: float = 0.0
    """Of e^{i (k Omega t + phase)} [rad]."""


Parameter = (
    JointParameter
    | SliderParameter
    | LevelParameter
    | FrequencyParameter
    | LoadParameter
    | MatrixParameter
    | ModelParameter
)


class Answer(NamedTuple):
    """What one steady state answers to p parameters."""

    loads: Complex[Array, "p harmonic r"]
    """Change of the loads [N / unit of the parameter]."""
    reaction: Complex[Array, "p harmonic d"]
    """... of the joint forces beyond D x, L dx + dg: with the loads it moves the structure."""
    force: Complex[Array, "p harmonic d"]
    """... of the joint forces f in their directions."""


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
        What to derive by.

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
    forces = forces_at(at_level, state.angular_frequency, state.motion, state.start, want=PARAMETERS)
    loads = np.zeros((len(parameters), *state.coefficients.shape), dtype=np.complex128)
    g = np.zeros((len(parameters), *forces.coefficients.shape))
    for number, parameter in enumerate(parameters):
        loads[number], g[number] = _change(at_level, state, forces, parameter)
    found = answer(at_level, condensed, forces, loads, g)
    return at_level.structure.displacements(condensed, loads - found.reaction @ at_level.structure.directions)


def derivatives(
    balance: HarmonicBalance, state: SteadyState, rates: ModelRates, condensed: Condensed, recovery: Recovery | None
) -> Answer:
    """What a state answers to the parameters of a model, where the linear structure at its Omega is at hand.

    Parameters
    ----------
    balance
        Balance at the level of the state.
    state, rates
        State and parameters of this balance.
    condensed, recovery
        The structure at the state's Omega, and maybe what recovers full responses.
    """
    forces = forces_at(balance, state.angular_frequency, state.motion, state.start, want=PARAMETERS)
    return answer(balance, condensed, forces, rates.loads(state), rates.forces(balance, forces.by_parameter), recovery)


def answer(
    balance: HarmonicBalance,
    condensed: Condensed,
    forces: JointForces,
    loads: Complex[Array, "p harmonic r"],
    g: Float[Real, "p d nh"],
    recovery: Recovery | None = None,
) -> Answer:
    """The answer to changes of the loads and, at fixed motion, of the joint forces.

    Parameters
    ----------
    balance
        Balance at the level of the state.
    condensed
        The linear structure at its Omega.
    forces
        Joint forces of the state, with their Jacobian.
    loads, g
        Changes, shapes (p, H + 1, r) [N] and (p, d, nh) [N].
    recovery
        Recovery of the structure at this Omega; by reciprocity it tells what loads move in the joint directions.
    """
    structure = balance.structure
    if recovery is None:
        right = structure.displacements(condensed, loads) @ structure.directions.T
    else:
        right = np.matmul(loads.swapaxes(0, 1), recovery.contact).swapaxes(0, 1)
    dg = complex_from_real(g)
    dx, reaction = _answers(balance, forces, condensed, right - _moved(condensed, dg))
    reaction = reaction + dg
    return Answer(loads, reaction, reaction + balance.table.reference * dx)


def _moved(condensed: Condensed, force: Complex[Array, "p harmonic d"]) -> Complex[Array, "p harmonic d"]:
    """A g of several forces; most parameters change none."""
    moved, loaded = np.zeros_like(force), force.any(axis=(1, 2))
    moved[loaded] = np.matmul(force[loaded].swapaxes(0, 1), condensed.columns).swapaxes(0, 1)
    return moved


def _answers(
    balance: HarmonicBalance, forces: JointForces, condensed: Condensed, right: Complex[Array, "p harmonic d"]
) -> tuple[Array, Array]:
    """Solve (I + A L) dx = right: dx and L dx, for several right-hand sides, shape (p, H + 1, d)."""
    first, count = balance.joint_of_direction
    rows = active_rows(forces.active)
    if len(rows) == 0 or len(right) == 0:
        return right, np.zeros_like(right)
    real = real_from_complex(right)
    nh = real.shape[2]
    matrix = small_matrix(rows, forces.jacobian, first, count, condensed.columns, nh)
    moved = np.array([times_jacobian(rows, forces.jacobian, first, count, item) for item in real])
    pushed = np.zeros_like(real)
    pushed[:, rows[:, 0], rows[:, 1]] = np.linalg.solve(matrix, moved.T).T
    reaction = complex_from_real(pushed)
    return right - _moved(condensed, reaction), reaction


def _change(
    balance: HarmonicBalance, state: SteadyState, forces: JointForces, parameter: Parameter
) -> tuple[Coefficients, Real]:
    """Change of loads and of joint forces at fixed motion, shapes (H + 1, r) and (d, nh)."""
    load, g = np.zeros_like(state.coefficients), np.zeros_like(forces.coefficients)
    if isinstance(parameter, JointParameter):
        joint, index = joint_index(balance, parameter.joint, parameter.name)
        g = spread(balance, joint, forces.by_parameter[index])
    elif isinstance(parameter, SliderParameter):
        slider = whole_number(parameter.slider, "slider", BalanceError)
        if not 0 <= slider < balance.n_slider:
            raise BalanceError(f"there is no slider {slider}: the system has {balance.n_slider}")
        joint = int(np.searchsorted(balance.table.slider, slider, side="right")) - 1
        g = spread(balance, joint, forces.by_start[slider])
    elif isinstance(parameter, LevelParameter):
        load = balance.structure.dynamic.copy()
    elif isinstance(parameter, LoadParameter):
        harmonic = checked_harmonic(parameter.harmonic, balance.n_harmonic)
        phase = finite_number(parameter.phase, "phase", BalanceError)
        row = entries(parameter.row, "the row of a load parameter", (balance.system.n_dof,))
        load[harmonic] = np.exp(1j * phase * (harmonic > 0)) * row
    elif isinstance(parameter, MatrixParameter):
        load = ModelRates.of(balance, [ModelParameter(matrices=parameter)]).loads(state)[0]
    elif isinstance(parameter, ModelParameter):
        rates = ModelRates.of(balance, [parameter])
        load, g = rates.loads(state)[0], rates.forces(balance, forces.by_parameter)[0]
    elif isinstance(parameter, FrequencyParameter):
        load, g = _frequency_load(balance, state), forces.by_frequency
    else:
        raise BalanceError(f"{parameter!r} is no parameter: give a JointParameter, a LoadParameter or another of these")
    return load, np.ascontiguousarray(g)


def _frequency_load(balance: HarmonicBalance, state: SteadyState) -> Coefficients:
    q, k = state.coefficients, np.arange(len(state.coefficients))[:, None]
    inertia = 2 * k**2 * state.angular_frequency * (q @ balance.system.mass.T)
    return np.asarray(inertia - 1j * k * (q @ balance.system.damping.T))
