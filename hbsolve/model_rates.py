"""Loads and joint forces that many parameters of a model change, for one state after another.

A change of the matrices is the load df_k = -(dK + i dH - (k Omega)^2 dM + i k Omega dC) q_k; the structural damping H
has no part in the mean.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Complex, Float

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.continuation_parameter import joint_index
from hbsolve.errors import BalanceError
from hbsolve.state import SteadyState
from reduction.array_input import finite_array
from reduction.array_type import Array, Matrix, Real, Row

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
    """A number that changes matrices, loads and joints at once, at the rates given."""

    matrices: MatrixParameter = field(default_factory=MatrixParameter)
    """dM/dp, dC/dp, dK/dp, dH/dp."""
    static_load: Row | None = None
    """Shape (r,) [N]; none for zero."""
    harmonic_force: Complex[Array, "k r"] | None = None
    """At level 1, shape (k, r) with row 0 zero [N]; none for zero."""
    joints: Mapping[tuple[str, str], float] = field(default_factory=dict)
    """Rates of the joints' parameters, by the names of joint and field."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelRates:
    """Rates of p parameters, checked and arranged once.

    Parameters
    ----------
    count
        Number of parameters p [-].
    matrices
        Number of the parameter, name of the matrix, and its rate, shape (r, r).
    static_load, harmonic_force
        Shapes (p, r) and (p, H + 1, r) [N].
    joints
        Rate of each parameter in the table of the joints, shape (p, n_parameter).
    """

    count: int
    matrices: Sequence[tuple[int, str, Matrix]]
    static_load: Float[Real, "p r"]
    harmonic_force: Complex[Array, "p harmonic r"]
    joints: Float[Real, "p parameter"]

    @classmethod
    def of(cls, balance: HarmonicBalance, parameters: Sequence[ModelParameter]) -> "ModelRates":
        """Check and arrange parameters of a balance.

        Raises
        ------
        BalanceError
            A joint or parameter that the system does not have, or an array of another size or not finite.
        """
        r, p = balance.system.n_dof, len(parameters)
        matrices, static = list[tuple[int, str, Matrix]](), np.zeros((p, r))
        harmonic = np.zeros((p, balance.n_harmonic, r), dtype=np.complex128)
        joints = np.zeros((p, len(balance.table.value)))
        for number, parameter in enumerate(parameters):
            for name in MATRICES:
                if (matrix := getattr(parameter.matrices, name)) is not None:
                    what = f"the {name.replace('_', ' ')} of a matrix parameter"
                    matrices.append((number, name, entries(matrix, what, (r, r))))
            if parameter.static_load is not None:
                static[number] = entries(parameter.static_load, "the static load of a model parameter", (r,))
            if parameter.harmonic_force is not None:
                retained = min(len(parameter.harmonic_force), balance.n_harmonic)
                harmonic[number, :retained] = parameter.harmonic_force[:retained]
            for (joint, name), rate in parameter.joints.items():
                joints[number, joint_index(balance, joint, name)[1]] += rate
        return cls(count=p, matrices=matrices, static_load=static, harmonic_force=harmonic, joints=joints)

    def loads(self, state: SteadyState) -> Complex[Array, "p harmonic r"]:
        """Change of the loads with each parameter, in a state, shape (p, H + 1, r) [N / its unit]."""
        q, loads = state.coefficients, state.level * self.harmonic_force
        loads[:, 0] += self.static_load
        k = np.arange(len(q))[:, None] * state.angular_frequency
        factors = {"mass": k**2, "damping": -1j * k, "stiffness": -1.0, "structural_damping": -1j * (k > 0)}
        # Real and imaginary parts below each other: half the work of a complex product.
        parts = np.concatenate([q.real, q.imag])
        for number, name, matrix in self.matrices:
            moved = parts @ matrix.T
            loads[number] += factors[name] * (moved[: len(q)] + 1j * moved[len(q) :])
        return loads

    def forces(self, balance: HarmonicBalance, by_parameter: Float[Real, "parameter 3 nh"]) -> Float[Real, "p d nh"]:
        """Change of the joint forces at fixed motion, shape (p, d, nh) [N / its unit].

        Parameters
        ----------
        balance
            Balance of the parameters.
        by_parameter
            Of the joint forces, as in `hbsolve.aft.JointForces`.
        """
        table, g = balance.table, np.zeros((self.count, balance.n_direction, by_parameter.shape[2]))
        for joint in range(len(table.kind)):
            (d0, d1), (p0, p1) = table.direction[joint : joint + 2], table.parameter[joint : joint + 2]
            changed = np.flatnonzero(self.joints[:, p0:p1].any(axis=1))
            if len(changed):
                g[changed, d0:d1] = np.tensordot(self.joints[changed, p0:p1], by_parameter[p0:p1, : d1 - d0], axes=1)
        return g


def entries(values: object, what: str, shape: tuple[int, ...]) -> Real:
    """Finite numbers of a shape; a `BalanceError` otherwise."""
    return finite_array(values, what, BalanceError, shape, ", over all degrees of freedom")
