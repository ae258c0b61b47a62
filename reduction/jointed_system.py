r"""Structure with joints as data: matrices, joints and loads.

The force of a joint is implemented twice on purpose, in `hbsolve` and in `transient`, to check each other.

A joint acts along directions, rows b over the degrees of freedom of the structure: its relative displacement is
u = b . q, and the force f of the joint enters the equation of motion as

.. math:: M \ddot q + C \dot q + K q + \sum b^T f(u, \dot u) = f_\mathrm{static}
          + \Re \sum_{k \ge 1} f_k\, e^{i k \Omega t}

so that a positive force resists a positive displacement. A complex stiffness K + i H adds structural damping, the force
i H q_k for each harmonic k >= 1 of the motion. `along` and `between` make rows; a row can be any linear combination of
degrees of freedom, such as a station between the nodes of a mesh.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Complex

from reduction.array_input import (
    check_array,
    check_complex_array,
    check_finite_array,
    check_finite_number,
    check_whole_number,
    refuse_infinite,
)
from reduction.array_type import Array, Matrix, Row, Vector
from reduction.available_memory import describe_lacking_memory
from reduction.errors import JointError
from reduction.joint_law.bouc_wen import BoucWenJoint
from reduction.joint_law.cubic_spring import CubicSpring
from reduction.joint_law.damped_stop import DampedStop
from reduction.joint_law.elastic_stop import ElasticStop
from reduction.joint_law.friction_contact import Friction, FrictionContact
from reduction.joint_law.friction_ellipse import FrictionEllipse
from reduction.joint_law.hertz_contact import HertzContact
from reduction.joint_law.iwan_joint import IwanJoint
from reduction.joint_law.jenkins import JenkinsElement
from reduction.joint_law.jenkins_chain import JenkinsChain
from reduction.joint_law.lugre import LuGreFriction
from reduction.joint_law.piecewise_damper import PiecewiseDamper
from reduction.joint_law.piecewise_spring import PiecewiseSpring
from reduction.joint_law.play import Play
from reduction.joint_law.polynomial_spring import PolynomialSpring
from reduction.joint_law.power_spring import PowerSpring
from reduction.joint_law.quadratic_damper import QuadraticDamper
from reduction.joint_law.registry import Joint
from reduction.joint_law.smooth_friction import SmoothFriction
from reduction.joint_law.structural_damper import StructuralDamper
from reduction.joint_law.valanis import ValanisJoint
from reduction.joint_law.viscous_damper import ViscousDamper

__all__ = [
    "BoucWenJoint",
    "CubicSpring",
    "DampedStop",
    "ElasticStop",
    "Friction",
    "FrictionContact",
    "FrictionEllipse",
    "HertzContact",
    "IwanJoint",
    "JenkinsChain",
    "JenkinsElement",
    "Joint",
    "JointedSystem",
    "LuGreFriction",
    "PiecewiseDamper",
    "PiecewiseSpring",
    "Play",
    "PolynomialSpring",
    "PowerSpring",
    "QuadraticDamper",
    "SmoothFriction",
    "StructuralDamper",
    "ValanisJoint",
    "ViscousDamper",
    "along",
    "between",
    "modal_damping",
]

#: Number of dense matrices of the same size in a system and its decomposition [-].
DENSE_COPIES = 12


@dataclass(frozen=True, kw_only=True, eq=False)
class JointedSystem:
    """Linear structure with nonlinear joints and loads; arrays are copied and read-only.

    Parameters
    ----------
    mass, damping, stiffness
        Matrices of the structure without its joints, shape (r, r) [kg, N s/m, N/m], dense, or SciPy's sparse matrices,
        which are converted to dense ones; the stiffness may be singular if only joints hold a body. The imaginary part
        of a complex stiffness, such as (1 + 0.01j) K for a loss factor of 1 %, is structural damping.
    joints
        Joints with different names, in the order of results.
    static_load
        Static load, shape (r,) [N]; none by default.
    harmonic_force
        Coefficients f_k of e^{i k Omega t} in the sum above, row k for harmonic k, shape (n_harmonic, r) [N]; row 0 is
        zero, because a constant force is a `static_load`. None by default.
    basis
        Mode shapes of a structure that differs from this one in few directions, shape (r, r); they speed up the
        solution for damping that couples the modes. None by default.
    structural_damping
        Imaginary part H of a complex stiffness, shape (r, r) [N/m]; none by default. It has no force in the time
        domain: periodic responses include it, integration and stability refuse it.

    Raises
    ------
    JointError
        Shapes that do not match, entries that are not real numbers, sparse matrices whose dense form exceeds the free
        memory, structural damping given twice, loads that are not finite, a force in row 0, or two joints of the same
        name.
    """

    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    joints: Sequence[Joint] = ()
    static_load: Row | None = None
    harmonic_force: Complex[Array, "harmonic r"] | None = None
    basis: Matrix | None = None
    structural_damping: Matrix | None = None

    def __post_init__(self) -> None:
        self._split_stiffness()
        for name in (
            "mass",
            "damping",
            "stiffness",
            *(() if self.structural_damping is None else ("structural_damping",)),
        ):
            object.__setattr__(
                self, name, check_array(_make_dense(getattr(self, name), name), f"the {_spell(name)}", JointError)
            )
            shape = getattr(self, name).shape
            if shape != self.mass.shape or len(shape) != 2 or shape[0] != shape[1] or not shape[0]:
                raise JointError(
                    f"the {_spell(name)} has shape {shape}, the mass {self.mass.shape}: give square matrices of one "
                    "size"
                )
        if self.structural_damping is not None:
            refuse_infinite(self.structural_damping, "the structural damping", JointError)
            if not self.structural_damping.any():
                object.__setattr__(self, "structural_damping", None)
        r = self.n_dof
        static = np.zeros(r) if self.static_load is None else self.static_load
        harmonic = np.zeros((1, r)) if self.harmonic_force is None else self.harmonic_force
        meaning = ", one number per degree of freedom"
        object.__setattr__(
            self, "static_load", check_finite_array(static, "the static load", JointError, (r,), meaning)
        )
        object.__setattr__(self, "harmonic_force", _check_harmonic_force(harmonic, r))
        object.__setattr__(self, "joints", _check_joints(self.joints))
        names: set[str] = set()
        for joint in self.joints:
            if joint.directions.shape[1] != r:
                raise JointError(
                    f'joint "{joint.name}" acts on {joint.directions.shape[1]} degrees of freedom, the structure has '
                    f"{r}: give rows over the whole structure (`along`, `between`)"
                )
            if joint.name in names:
                raise JointError(f'two joints are called "{joint.name}": give each a different name')
            names.add(joint.name)

    def _split_stiffness(self) -> None:
        """Move the imaginary part of a complex stiffness to the structural damping."""
        stiffness = _make_dense(self.stiffness, "stiffness")
        object.__setattr__(self, "stiffness", stiffness)
        given = np.asarray(stiffness) if np.iscomplexobj(stiffness) else None
        if given is None or not given.imag.any():
            return
        if self.structural_damping is not None:
            raise JointError(
                "the stiffness is complex, and structural_damping is given as well: remove one of them, since the "
                "imaginary part of the stiffness is the structural damping"
            )
        object.__setattr__(self, "stiffness", given.real)
        object.__setattr__(self, "structural_damping", given.imag)

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom r [-]."""
        return len(self.mass)

    @property
    def static(self) -> Row:
        """Static load, zeros if none was given, shape (r,) [N]."""
        assert self.static_load is not None
        return self.static_load

    @property
    def dynamic(self) -> Complex[Array, "harmonic r"]:
        """Harmonic force, zeros if none was given, shape (n_harmonic, r) [N]."""
        assert self.harmonic_force is not None
        return self.harmonic_force


def along(n_dof: int, weights: Mapping[int, float]) -> Row:
    """Row of a displacement that is a linear combination of degrees of freedom.

    Parameters
    ----------
    n_dof
        Number of degrees of freedom of the structure, r [-].
    weights
        Weight of each degree of freedom, counted from 0 [-].

    Raises
    ------
    JointError
        A degree of freedom that does not exist, or a weight that is not a finite number.
    """
    count = check_whole_number(n_dof, "n_dof", JointError)
    if count < 1:
        raise JointError(f"n_dof = {count} must be positive: give the number of degrees of freedom")
    if not isinstance(weights, Mapping):
        raise JointError(f"the weights are a {type(weights).__name__}: give a mapping such as {{0: 1.0, 3: -1.0}}")
    row = np.zeros(count)
    for given, weight in weights.items():
        dof = check_whole_number(given, "degree of freedom", JointError)
        if not 0 <= dof < count:
            raise JointError(f"degree of freedom {dof} does not exist: the structure has 0 to {count - 1}")
        row[dof] += check_finite_number(weight, f"the weight of degree of freedom {dof}", JointError)
    return row


def between(n_dof: int, dof: int, other: int | None = None) -> Row:
    """Row of the displacement of a degree of freedom relative to another, or to the ground.

    Raises
    ------
    JointError
        A degree of freedom that does not exist, or two equal degrees of freedom.
    """
    if dof == other:
        raise JointError(f"degree of freedom {dof} does not move relative to itself: give two different ones")
    return along(n_dof, {dof: 1.0} if other is None else {dof: 1.0, other: -1.0})


def modal_damping(system: JointedSystem, shapes: Matrix, angular_frequency: Vector) -> Vector:
    """Damping 2 zeta omega of mass-normalised modes, phi^T (C + H / omega) phi, shape (m,) [1/s].

    Parameters
    ----------
    system
        System with the damping.
    shapes, angular_frequency
        Modes, shapes (r, m) and (m,) [kg^-1/2, rad/s]; a rigid-body motion has no structural damping.
    """
    rate = np.einsum("rm,rm->m", shapes, system.damping @ shapes)
    if system.structural_damping is not None:
        loss = np.einsum("rm,rm->m", shapes, system.structural_damping @ shapes)
        rate += np.divide(loss, angular_frequency, out=np.zeros_like(rate), where=np.asarray(angular_frequency) > 0)
    return np.asarray(rate)


def _spell(name: str) -> str:
    return name.replace("_", " ")


def _make_dense(given: Any, name: str) -> Any:
    """Convert a sparse matrix to a dense array; other values are returned unchanged."""
    if not hasattr(given, "toarray"):
        return given
    needed = DENSE_COPIES * np.dtype(np.float64).itemsize * float(np.prod(given.shape))
    if lacking := describe_lacking_memory(needed):
        raise JointError(
            f"the {_spell(name)} is sparse of shape {given.shape}: its dense matrices take {lacking}; reduce the "
            "structure first (craig_bampton), which takes sparse matrices as they are"
        )
    return given.toarray()


def _check_joints(given: object) -> tuple[Joint, ...]:
    if isinstance(given, Joint):
        raise JointError(f"the joints are one joint, {given.name!r}: give a list of joints")
    joints: list[Joint] = []
    for number, joint in enumerate(given):  # type: ignore[arg-type, var-annotated]
        if not isinstance(joint, Joint):
            raise JointError(
                f"joint {number} is a {type(joint).__name__}: give a contact, a spring, a stop or a damper"
            )
        joints.append(joint)
    return tuple(joints)


def _check_harmonic_force(given: object, n_dof: int) -> Complex[Array, "harmonic r"]:
    harmonic = check_complex_array(given, "the harmonic force", JointError)
    if harmonic.ndim != 2 or harmonic.shape[1] != n_dof or not len(harmonic):
        raise JointError(
            f"the harmonic force has shape {harmonic.shape}: give (n_harmonic, {n_dof}), row k for harmonic k"
        )
    refuse_infinite(harmonic, "the harmonic force", JointError)
    if harmonic[0].any():
        dof = int(np.flatnonzero(harmonic[0])[0])
        raise JointError(
            f"the harmonic force has {harmonic[0, dof]:g} N in row 0 on degree of freedom {dof}: give a constant "
            "force as static_load; row k is harmonic k"
        )
    return harmonic
