"""Derivatives of loads and joint forces by many parameters of a model, for one state after another.

A change of the matrices acts as the load df_k = -(dK + i dH - (k Omega)^2 dM + i k Omega dC) q_k; the structural
damping H does not act on the mean.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int

from fe.compiled import compiled
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.continuation_parameter import find_joint_index
from hbsolve.errors import BalanceError
from hbsolve.state import SteadyState
from reduction.array_input import check_finite_array
from reduction.array_type import Array, Matrix, Real, Row, Whole

MATRICES = ("mass", "damping", "stiffness", "structural_damping")


@dataclass(frozen=True, kw_only=True, eq=False)
class MatrixParameter:
    """A number that multiplies an addition to the matrices; see `point_mass`, `spring`, `damper` and `scaled`."""

    mass: Matrix | None = None
    damping: Matrix | None = None
    stiffness: Matrix | None = None
    structural_damping: Matrix | None = None
    """dM/dp, dC/dp, dK/dp, dH/dp, shape (r, r); none for zero."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelParameter:
    """A number that changes matrices, loads and joints together, at given rates."""

    matrices: MatrixParameter = field(default_factory=MatrixParameter)
    """dM/dp, dC/dp, dK/dp, dH/dp."""
    static_load: Row | None = None
    """Rate of the static load, shape (r,) [N]; none for zero."""
    harmonic_force: Complex[Array, "k r"] | None = None
    """Rate of the harmonic force at level 1, shape (k, r) with row 0 zero [N]; none for zero."""
    joints: Mapping[tuple[str, str], float] = field(default_factory=dict)
    """Rates of the joints' parameters, by the names of joint and field."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelRates:
    """Rates of p parameters, checked and arranged once.

    Parameters
    ----------
    matrices
        Rates of m matrices, stacked, shape (m r, r).
    parameter, kind
        Number of the parameter and kind of each matrix as an index of `MATRICES`, shape (m,).
    static_load, harmonic_force
        Rates of the loads, shapes (p, r) and (p, H + 1, r) [N].
    joints
        Rate of each parameter in the table of the joints, shape (p, n_parameter).
    """

    matrices: Float[Real, "m*r r"]
    parameter: Int[Whole, " m"]
    kind: Int[Whole, " m"]
    static_load: Float[Real, "p r"]
    harmonic_force: Complex[Array, "p harmonic r"]
    joints: Float[Real, "p parameter"]

    @classmethod
    def from_parameters(cls, balance: HarmonicBalance, parameters: Sequence[ModelParameter]) -> "ModelRates":
        """Check and arrange parameters of a balance.

        Raises
        ------
        BalanceError
            A joint or parameter that the system does not have, or an array of another size or not finite.
        """
        r, p = balance.system.n_dof, len(parameters)
        matrices, of_matrix, static = [np.zeros((0, r))], list[tuple[int, int]](), np.zeros((p, r))
        harmonic = np.zeros((p, balance.n_harmonic, r), dtype=np.complex128)
        joints = np.zeros((p, len(balance.table.value)))
        for number, parameter in enumerate(parameters):
            for kind, name in enumerate(MATRICES):
                if (matrix := getattr(parameter.matrices, name)) is not None:
                    what = f"the {name.replace('_', ' ')} of a matrix parameter"
                    matrices.append(check_entries(matrix, what, (r, r)))
                    of_matrix.append((number, kind))
            if parameter.static_load is not None:
                static[number] = check_entries(parameter.static_load, "the static load of a model parameter", (r,))
            if parameter.harmonic_force is not None:
                retained = min(len(parameter.harmonic_force), balance.n_harmonic)
                harmonic[number, :retained] = parameter.harmonic_force[:retained]
            for (joint, name), rate in parameter.joints.items():
                joints[number, find_joint_index(balance, joint, name)[1]] += rate
        numbers, kinds = np.array(of_matrix, dtype=np.int64).reshape(-1, 2).T
        return cls(
            matrices=np.concatenate(matrices), parameter=numbers, kind=kinds, static_load=static,
            harmonic_force=harmonic, joints=joints,
        )  # fmt: skip

    def loads(self, state: SteadyState) -> Complex[Array, "p harmonic r"]:
        """Change of the loads with each parameter, in a state, shape (p, H + 1, r) [N / its unit]."""
        q, loads = state.coefficients, state.level * self.harmonic_force
        loads[:, 0] += self.static_load
        k = np.arange(len(q)) * state.angular_frequency
        factors = np.array([k**2, -1j * k, np.full(len(k), -1.0), -1j * (k > 0)])
        # Real and imaginary parts stacked: half the work of a complex product.
        moved = np.concatenate([q.real, q.imag]) @ self.matrices.T
        moved = (moved[: len(q)] + 1j * moved[len(q) :]).reshape(len(q), len(self.kind), q.shape[1])
        np.add.at(loads, self.parameter, factors[self.kind][..., None] * moved.swapaxes(0, 1))
        return loads

    def forces(self, balance: HarmonicBalance, by_parameter: Float[Real, "parameter 3 nh"]) -> Float[Real, "p d nh"]:
        """Change of the joint forces at fixed motion, shape (p, d, nh) [N / its unit].

        Parameters
        ----------
        balance
            Balance of the parameters.
        by_parameter
            Derivatives of the joint forces, as in `hbsolve.aft.JointForces`.
        """
        table = balance.table
        return np.asarray(_sum_over_joints(self.joints, by_parameter, table.direction, table.parameter))


@compiled
def _sum_over_joints(rates: Any, by_parameter: Any, direction: Any, parameter: Any) -> Any:
    """Derivatives of each joint's forces by its parameters, times their rates, summed, shape (p, d, nh)."""
    total = np.zeros((len(rates), direction[-1], by_parameter.shape[2]))
    for joint in range(len(direction) - 1):
        first, count = direction[joint], direction[joint + 1] - direction[joint]
        for number in range(parameter[joint], parameter[joint + 1]):
            for p in range(len(rates)):
                if rates[p, number] != 0.0:
                    total[p, first : first + count] += rates[p, number] * by_parameter[number, :count]
    return total


def check_entries(values: object, what: str, shape: tuple[int, ...]) -> Real:
    """Return an array of finite numbers; refuse (`BalanceError`) another shape or other entries."""
    return check_finite_array(values, what, BalanceError, shape, ", over all degrees of freedom")
