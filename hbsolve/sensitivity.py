r"""Derivatives of a steady state by the implicit function theorem, exact and without another solution.

A change dp of a parameter changes the loads and the joint forces at fixed motion by df and dg; the motion answers with

.. math:: (I + A L)\, dx = B \alpha\, df - A\, dg, \qquad dq = \alpha \left( df - B^T (L\, dx + dg) \right) .

A change of the matrices is the load df_k = -(dK - (k \Omega)^2 dM + i k \Omega\, dC) q_k.

References
----------
Petrov, Mech. Syst. Signal Process. 23 (2009): sensitivities of friction-damped structures.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex

from fe.blas_threads import on_one_blas_thread
from hbsolve.aft import JointForces
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.continuation.continuation_parameter import joint_index, spread
from hbsolve.errors import BalanceError
from hbsolve.fourier import Coefficients
from hbsolve.joint_law.registry import PARAMETERS
from hbsolve.linearised import active_rows, scattered, small_matrix, times_jacobian
from hbsolve.newton import apply_receptance
from hbsolve.sampling import complex_from_real, real_from_complex
from hbsolve.solution import forces_at
from hbsolve.state import SteadyState, check_state, checked_harmonic
from reduction.array_input import finite_array, finite_number, whole_number
from reduction.array_type import Array, Matrix, Real, Row


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


@dataclass(frozen=True, kw_only=True, eq=False)
class MatrixParameter:
    """A number that multiplies an addition to the matrices; see `point_mass`, `spring`, `damper` and `scaled`."""

    mass: Matrix | None = None
    damping: Matrix | None = None
    stiffness: Matrix | None = None
    """dM/dp, dC/dp, dK/dp, shape (r, r); none for zero."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelParameter:
    """A number that changes matrices, loads and joints at once, at the rates given."""

    matrices: MatrixParameter = field(default_factory=MatrixParameter)
    """dM/dp, dC/dp, dK/dp."""
    static_load: Row | None = None
    """Shape (r,) [N]; none for zero."""
    harmonic_force: Complex[Array, "k r"] | None = None
    """At level 1, shape (k, r) with row 0 zero [N]; none for zero."""
    joints: Mapping[tuple[str, str], float] = field(default_factory=dict)
    """Rates of the joints' parameters, by the names of joint and field."""


Parameter = (
    JointParameter
    | SliderParameter
    | LevelParameter
    | FrequencyParameter
    | LoadParameter
    | MatrixParameter
    | ModelParameter
)


class Derivatives(NamedTuple):
    """Of one steady state with respect to p parameters."""

    coefficients: Complex[Array, "p harmonic r"]
    """Of all degrees of freedom [m / unit of the parameter]."""
    force: Complex[Array, "p harmonic d"]
    """Of the joint forces f in their directions [N / unit of the parameter]."""


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
    return derivatives(balance, state, parameters).coefficients


@on_one_blas_thread
def derivatives(
    balance: HarmonicBalance, state: SteadyState, parameters: Sequence[Parameter], condensed: Condensed | None = None
) -> Derivatives:
    """As `sensitivity`, with the derivatives of the joint forces; `condensed` is the structure at the state's Omega."""
    if isinstance(parameters, Parameter):
        raise BalanceError(f"the parameters are one {type(parameters).__name__}: give a list of parameters")
    check_state(balance, state)
    at_level = balance.at_level(state.level)
    condensed = at_level.at(state.angular_frequency) if condensed is None else condensed
    forces = forces_at(at_level, state.angular_frequency, state.motion, state.start, want=PARAMETERS)
    structure, p = at_level.structure, len(parameters)
    loads = np.zeros((p, *state.coefficients.shape), dtype=np.complex128)
    g = np.zeros((p, *forces.coefficients.shape))
    for number, parameter in enumerate(parameters):
        loads[number], g[number] = _change(at_level, state, forces, parameter)
    right, loaded = np.zeros_like(g), loads.any(axis=(1, 2))
    right[loaded] = real_from_complex(structure.displacements(condensed, loads[loaded]) @ structure.directions.T)
    for number in range(p):
        right[number] -= apply_receptance(condensed.receptance, g[number])
    dx, answer = _answers(at_level, forces, condensed, right)
    force = np.array([complex_from_real(item) for item in answer + g], dtype=np.complex128)
    force = force.reshape(p, balance.n_harmonic, -1)
    moved = structure.displacements(condensed, loads - force @ structure.directions)
    elastic = np.array([complex_from_real(item) for item in at_level.table.reference[:, None] * dx])
    return Derivatives(moved, force + elastic.reshape(force.shape))


def _answers(balance: HarmonicBalance, forces: JointForces, condensed: Condensed, right: Real) -> tuple[Real, Real]:
    """Solve (I + A L) dx = right: dx and L dx, for several right-hand sides, shape (p, d, nh)."""
    first, count = balance.joint_of_direction
    rows = active_rows(forces.active)
    dx, answer = right.copy(), np.zeros_like(right)
    if len(rows) == 0 or len(right) == 0:
        return dx, answer
    d, nh = right.shape[1:]
    matrix = small_matrix(rows, forces.jacobian, first, count, condensed.receptance, nh)
    moved = np.array([times_jacobian(rows, forces.jacobian, first, count, item) for item in right])
    for number, y in enumerate(np.linalg.solve(matrix, moved.T).T):
        answer[number] = scattered(rows, np.ascontiguousarray(y), d, nh)
        dx[number] -= apply_receptance(condensed.receptance, answer[number])
    return dx, answer


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
        row = _entries(parameter.row, "the row of a load parameter", (balance.system.n_dof,))
        load[harmonic] = np.exp(1j * phase * (harmonic > 0)) * row
    elif isinstance(parameter, MatrixParameter):
        load = _matrix_load(state, parameter)
    elif isinstance(parameter, ModelParameter):
        load, g = _model_change(balance, state, forces, parameter)
    elif isinstance(parameter, FrequencyParameter):
        load, g = _frequency_load(balance, state), forces.by_frequency
    else:
        raise BalanceError(f"{parameter!r} is no parameter: give a JointParameter, a LoadParameter or another of these")
    return load, np.ascontiguousarray(g)


def _model_change(
    balance: HarmonicBalance, state: SteadyState, forces: JointForces, parameter: ModelParameter
) -> tuple[Coefficients, Real]:
    load, g = _matrix_load(state, parameter.matrices), np.zeros_like(forces.coefficients)
    r = load.shape[1]
    if parameter.static_load is not None:
        load[0] += _entries(parameter.static_load, "the static load of a model parameter", (r,))
    if parameter.harmonic_force is not None:
        retained = min(len(parameter.harmonic_force), len(load))
        load[:retained] += balance.level * parameter.harmonic_force[:retained]
    for (joint, name), rate in parameter.joints.items():
        number, index = joint_index(balance, joint, name)
        g += rate * spread(balance, number, forces.by_parameter[index])
    return load, g


def _entries(values: object, what: str, shape: tuple[int, ...]) -> Real:
    return finite_array(values, what, BalanceError, shape, ", over all degrees of freedom")


def _matrix_load(state: SteadyState, parameter: MatrixParameter) -> Coefficients:
    q = state.coefficients
    k = np.arange(len(q))[:, None] * state.angular_frequency
    load = np.zeros_like(q)
    for name, factor in (("mass", k**2), ("damping", -1j * k), ("stiffness", -1.0)):
        matrix = getattr(parameter, name)
        if matrix is not None:
            load += factor * (q @ _entries(matrix, f"the {name} of a matrix parameter", (q.shape[1],) * 2).T)
    return load


def _frequency_load(balance: HarmonicBalance, state: SteadyState) -> Coefficients:
    q, k = state.coefficients, np.arange(len(state.coefficients))[:, None]
    inertia = 2 * k**2 * state.angular_frequency * (q @ balance.system.mass.T)
    return np.asarray(inertia - 1j * k * (q @ balance.system.damping.T))
