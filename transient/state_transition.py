r"""Exact motion of the linear structure over one step, in modal coordinates.

.. math:: \ddot q + C_m \dot q + \Lambda q = \Phi^T \bigl(\Re \sum f_k e^{i k \Omega t} + f_\mathrm{static}\bigr)
          - \Phi^T B^T f

with Phi the mass-normalised modes of M and K + B^T diag(k_0) B; f are then the joint forces beyond the springs k_0.
k_0 is the stiffness of sticking, closed joints: they move exactly, however stiff. Where the damping is diagonal with
k_0 = 0 only, that basis is taken, and where it is diagonal in neither, full matrices are. The increments of harmonic
and static loads over a step, and of a constant joint force, come from matrix exponentials of the structure
together with the generator of its load (Van Loan): exact for any step.

References
----------
Van Loan, Computing integrals involving the matrix exponential, IEEE Transactions on Automatic Control 23 (1978).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from reduction.array_input import refuse_asymmetric, refuse_infinite, refuse_massless
from reduction.array_type import Array, Matrix, Vector
from reduction.jointed_system import JointedSystem
from transient.errors import TransientError
from transient.joint_arrays import TransientJointTable, make_joint_table

#: Share of the largest modal damping below which the other entries are round-off of the modes.
DIAGONAL = 1e-9
#: Relative asymmetry of mass and stiffness that still counts as round-off.
SKEW = 1e-8


@dataclass(frozen=True, kw_only=True, eq=False)
class ModalStructure:
    """A jointed system in the modal coordinates of its linear structure with the springs k_0."""

    system: JointedSystem
    """What it was made from."""
    table: TransientJointTable
    """Its joints."""
    mode_shapes: Matrix
    """Phi, mass-normalised, shape (r, r) [kg^-1/2]."""
    inverse_shapes: Matrix
    """Phi^T M, the inverse of Phi, shape (r, r) [kg^1/2]."""
    eigenvalue: Vector
    """Diagonal of Lambda, shape (r,) [1/s^2]."""
    damping: Matrix
    """C_m, shape (r, r) [1/s]."""
    diagonal: bool
    """Whether C_m is diagonal."""
    offset: Vector
    """k_0, shape (d,) [N/m]."""

    @property
    def rows(self) -> Matrix:
        """Directions of the joints over the modes, B Phi, shape (d, r) [kg^-1/2]."""
        return np.ascontiguousarray(self.table.rows @ self.mode_shapes)


class Transition(NamedTuple):
    """One step of a structure, as the compiled integration reads it."""

    step: float
    """Its length [s]."""
    diagonal: bool
    """Whether the modes uncouple."""
    matrix: Matrix
    """Rows a_qq, a_qv, a_vq, a_vv, shape (4, r), if `diagonal`, else shape (2 r, 2 r)."""
    input_factor: Matrix
    """What a constant modal force adds to q and v, shape (2, r); empty where not diagonal."""
    input_matrix: Matrix
    """What constant joint forces add, shape (2 r, d); empty where diagonal."""
    rows: Matrix
    """Directions of the joints over the modes, shape (d, r) [kg^-1/2]."""
    columns: Matrix
    """Their transpose."""
    flexibility: Matrix
    """G, shape (d, d) [m/N]."""
    offset: Vector
    """k_0, shape (d,) [N/m]."""
    harmonic: Matrix
    """Increment by the harmonic force at level 1 in each step of a period, shape (n, 2 r)."""
    static: Vector
    """Increment by the static load, shape (2 r,)."""


def make_modal_structure(system: "JointedSystem | ModalStructure") -> ModalStructure:
    """Modes of the structure with sticking joints if they make the damping diagonal, else without joints if those do.

    A modal structure is returned as it is.

    Raises
    ------
    TransientError
        A mass that is not positive definite, or a matrix that is not symmetric or not finite.
    """
    if isinstance(system, ModalStructure):
        return system
    _check(system)
    table = make_joint_table(system)
    stuck = decompose(system, table, table.stuck_stiffness)
    if stuck.diagonal:
        return stuck
    bare = decompose(system, table, np.zeros_like(table.stuck_stiffness))
    return bare if bare.diagonal else stuck


def transition(structure: ModalStructure, angular_frequency: float, steps_per_period: int) -> Transition:
    """Exact step of 1 / steps_per_period of the period of an excitation at Omega [rad/s]."""
    step = 2 * np.pi / (angular_frequency * steps_per_period)
    system, shapes = structure.system, structure.mode_shapes
    amplitude = system.dynamic @ shapes
    static = shapes.T @ system.static
    rows = structure.rows
    numbers = [k for k in range(len(amplitude)) if amplitude[k].any()]
    phase = np.exp(2j * np.pi * np.outer(np.arange(steps_per_period), numbers) / steps_per_period)
    r = system.n_dof
    build = _make_diagonal_step if structure.diagonal else _make_full_step
    matrix, sustained, forced = build(structure, step, angular_frequency, numbers, amplitude[numbers])
    harmonic = np.ascontiguousarray((phase @ forced).real) if numbers else np.zeros((1, 2 * r))
    if structure.diagonal:
        increment = (sustained * static).ravel()
        flexibility = rows @ (sustained[0][:, None] * rows.T)
        factor, input_matrix = sustained, np.zeros((0, 0))
    else:
        # sustained: shape (2r, d + 1), the static load in the last column.
        increment, input_matrix = sustained[:, -1].copy(), np.ascontiguousarray(sustained[:, :-1])
        flexibility = rows @ input_matrix[:r]
        factor = np.zeros((0, 0))
    return Transition(
        step=step,
        diagonal=structure.diagonal,
        matrix=np.ascontiguousarray(matrix),
        input_factor=factor,
        input_matrix=input_matrix,
        rows=rows,
        columns=np.ascontiguousarray(rows.T),
        flexibility=np.ascontiguousarray(flexibility),
        offset=structure.offset,
        harmonic=harmonic,
        static=increment,
    )


def modes(system: JointedSystem, table: TransientJointTable, offset: Vector) -> tuple[Vector, Matrix]:
    """Eigenvalues [1/s^2] and mass-normalised shapes of the structure with springs k_0 of shape (d,) at its joints."""
    from scipy.linalg import eigh

    eigenvalue, shapes = eigh(system.stiffness + table.rows.T @ (offset[:, None] * table.rows), system.mass)
    return eigenvalue, shapes


def decompose(system: JointedSystem, table: TransientJointTable, offset: Vector) -> ModalStructure:
    """The structure with the springs k_0, shape (d,) [N/m], in its modes.

    Raises
    ------
    TransientError
        Structural damping.
    """
    if system.structural_damping is not None:
        raise TransientError(
            "the system has structural damping (a complex stiffness), which is not defined in the time domain: give "
            "it as viscous damping, structural_damping / omega at the frequency of interest"
        )
    eigenvalue, shapes = modes(system, table, offset)
    damping = shapes.T @ system.damping @ shapes
    others = damping - np.diag(np.diag(damping))
    return ModalStructure(
        system=system,
        table=table,
        mode_shapes=shapes,
        inverse_shapes=shapes.T @ system.mass,
        eigenvalue=eigenvalue,
        damping=damping,
        diagonal=bool(np.abs(others).max(initial=0.0) <= DIAGONAL * np.abs(damping).max(initial=0.0)),
        offset=offset,
    )


def _make_diagonal_step(
    structure: ModalStructure, step: float, angular_frequency: float, numbers: list[int], amplitude: Array
) -> tuple[Matrix, Matrix, Array]:
    """Transition (4, r), what a constant modal force adds (2, r), what each harmonic adds (number, 2r)."""
    from scipy.linalg import expm

    r = len(structure.eigenvalue)
    # Balanced variables (scale q, v) keep the exponential of a stiff mode a rotation.
    scale = np.maximum(np.sqrt(np.abs(structure.eigenvalue)), 1 / step)
    generator = np.zeros((r, 3, 3))
    generator[:, 0, 1] = scale * step
    generator[:, 1, 0] = -structure.eigenvalue * step / scale
    generator[:, 1, 1] = -np.diag(structure.damping) * step
    generator[:, 1, 2] = 1.0
    exact = expm(generator)
    matrix = np.array([exact[:, 0, 0], exact[:, 0, 1] / scale, exact[:, 1, 0] * scale, exact[:, 1, 1]])
    sustained = np.array([exact[:, 0, 2] / scale, exact[:, 1, 2]]) * step
    forced = np.zeros((len(numbers), 2 * r), dtype=np.complex128)
    for row, k in enumerate(numbers):
        angle = k * angular_frequency * step
        augmented = np.zeros((r, 4, 4))
        augmented[:, :2, :2] = generator[:, :2, :2]
        augmented[:, 1, 2] = 1.0
        augmented[:, 2, 3], augmented[:, 3, 2] = -angle, angle
        # (cos, sin) turn as z' = i angle z; the response to cos is the real part of that to e^{i angle s}.
        answer = expm(augmented)
        unit = answer[:, :2, 2] - 1j * answer[:, :2, 3]
        forced[row, :r] = unit[:, 0] / scale * amplitude[row] * step
        forced[row, r:] = unit[:, 1] * amplitude[row] * step
    return matrix, sustained, forced


def _make_full_step(
    structure: ModalStructure, step: float, angular_frequency: float, numbers: list[int], amplitude: Array
) -> tuple[Matrix, Matrix, Array]:
    """Transition (2r, 2r), what constant joint forces and the static load add (2r, d + 1), what each harmonic adds."""
    from scipy.linalg import expm

    r = len(structure.eigenvalue)
    scale = np.maximum(np.sqrt(np.abs(structure.eigenvalue)), 1 / step)
    constant = np.column_stack([structure.rows.T, structure.mode_shapes.T @ structure.system.static])
    # Loads of any size as columns of size one: the exponential is accurate relative to its largest entry.
    size = np.maximum(np.abs(constant).max(axis=0), np.finfo(float).tiny)
    size_forced = np.maximum(np.abs(amplitude).max(axis=1), np.finfo(float).tiny) if numbers else np.zeros(0)
    n_constant, n = constant.shape[1], 2 * r + constant.shape[1] + 2 * len(numbers)
    generator = np.zeros((n, n))
    generator[:r, r : 2 * r] = np.diag(scale * step)
    generator[r : 2 * r, :r] = np.diag(-structure.eigenvalue * step / scale)
    generator[r : 2 * r, r : 2 * r] = -structure.damping * step
    generator[r : 2 * r, 2 * r : 2 * r + n_constant] = constant / size
    for row, k in enumerate(numbers):
        at, angle = 2 * r + n_constant + 2 * row, k * angular_frequency * step
        generator[r : 2 * r, at] = amplitude[row].real / size_forced[row]
        generator[r : 2 * r, at + 1] = -amplitude[row].imag / size_forced[row]
        generator[at, at + 1], generator[at + 1, at] = -angle, angle
    exact = expm(generator)[: 2 * r]
    unscale = np.concatenate([1 / scale, np.ones(r)])
    rescale = np.concatenate([scale, np.ones(r)])
    matrix = unscale[:, None] * exact[:, : 2 * r] * rescale
    sustained = unscale[:, None] * exact[:, 2 * r : 2 * r + n_constant] * (size * step)
    tail = exact[:, 2 * r + n_constant :]
    forced = (tail[:, 0::2] - 1j * tail[:, 1::2]).T * unscale * (size_forced * step)[:, None]
    return matrix, sustained, forced


def _check(system: JointedSystem) -> None:
    if not isinstance(system, JointedSystem):
        raise TransientError(f"the system is a {type(system).__name__}: give a JointedSystem")
    for name in ("mass", "damping", "stiffness"):
        refuse_infinite(getattr(system, name), f"the {name}", TransientError)
    for name in ("mass", "stiffness"):
        refuse_asymmetric(getattr(system, name), f"the {name}", TransientError, SKEW)
    refuse_massless(system.mass, TransientError)
