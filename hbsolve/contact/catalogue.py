"""All laws: the number, the parameters and the reference stiffness of each kind of joint, and the compiled switch."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fe.compiled import compiled
from hbsolve.contact import coulomb, cubic, elastic_stop, friction, jenkins, quadratic_damper
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    QuadraticDamper,
)

_FRICTION, _COULOMB, _JENKINS, _CUBIC, _STOP, _DAMPER = range(6)

# A compiled function sees its globals by name, not through their modules.
_friction, _coulomb, _jenkins = friction.force, coulomb.force, jenkins.force
_cubic, _stop, _damper = cubic.force, elastic_stop.force, quadratic_damper.force


class JointTable(NamedTuple):
    """Joints as arrays, one row each; d directions, s sliders and p parameters in all."""

    kind: NDArray[np.int64]
    direction: NDArray[np.int64]
    """First direction of each joint and, last, d: shape (n_joint + 1,)."""
    slider: NDArray[np.int64]
    """First slider of each joint and, last, s."""
    parameter: NDArray[np.int64]
    """First parameter of each joint and, last, p."""
    value: NDArray[np.float64]
    """Parameters, shape (p,)."""
    reference: NDArray[np.float64]
    """Stiffness of each direction in the linear structure, D of eq. 12, shape (d,) [N/m]."""


def kind(joint: Joint) -> int:
    """Number of a joint's law."""
    if isinstance(joint, FrictionContact):
        coupled = joint.friction is Friction.COULOMB and len(joint.tangents) == 2
        return _COULOMB if coupled else _FRICTION
    return {JenkinsElement: _JENKINS, CubicSpring: _CUBIC, ElasticStop: _STOP, QuadraticDamper: _DAMPER}[type(joint)]


def parameter_names(joint: Joint) -> tuple[str, ...]:
    """Names of a joint's parameters: fields of its class, in the order of the law."""
    if isinstance(joint, FrictionContact):
        return friction.NAMES
    return {
        JenkinsElement: jenkins.NAMES,
        CubicSpring: cubic.NAMES,
        ElasticStop: elastic_stop.NAMES,
        QuadraticDamper: quadratic_damper.NAMES,
    }[type(joint)]


def n_slider(joint: Joint) -> int:
    """Sliders of a joint: one a tangent."""
    if isinstance(joint, FrictionContact):
        return len(joint.tangents)
    return int(isinstance(joint, JenkinsElement))


def reference_stiffness(joint: Joint) -> list[float]:
    """Stiffness of each direction when stuck and closed; none for laws that are weak at rest."""
    if isinstance(joint, FrictionContact):
        return [joint.tangential_stiffness] * len(joint.tangents) + [joint.normal_stiffness]
    if isinstance(joint, JenkinsElement):
        return [joint.tangential_stiffness]
    if isinstance(joint, ElasticStop) and joint.gap < 0:
        return [joint.stiffness]
    return [0.0]


def joint_table(joints: Sequence[Joint]) -> JointTable:
    """Joints as arrays."""
    names = [parameter_names(joint) for joint in joints]
    return JointTable(
        kind=np.array([kind(joint) for joint in joints], dtype=np.int64),
        direction=_starts([len(joint.directions) for joint in joints]),
        slider=_starts([n_slider(joint) for joint in joints]),
        parameter=_starts([len(each) for each in names]),
        value=np.array([float(getattr(j, name)) for j, each in zip(joints, names, strict=True) for name in each]),
        reference=np.array([stiffness for joint in joints for stiffness in reference_stiffness(joint)]),
    )


@compiled
def joint_force(
    kind: int, u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """Call the law of one joint."""
    if kind == _FRICTION:
        _friction(u, velocity, omega, reference, parameters, start, by_multiplier, sampling, want, out)
    elif kind == _COULOMB:
        _coulomb(u, velocity, omega, reference, parameters, start, by_multiplier, sampling, want, out)
    elif kind == _JENKINS:
        _jenkins(u, velocity, omega, reference, parameters, start, by_multiplier, sampling, want, out)
    elif kind == _CUBIC:
        _cubic(u, velocity, omega, reference, parameters, start, by_multiplier, sampling, want, out)
    elif kind == _STOP:
        _stop(u, velocity, omega, reference, parameters, start, by_multiplier, sampling, want, out)
    elif kind == _DAMPER:
        _damper(u, velocity, omega, reference, parameters, start, by_multiplier, sampling, want, out)


def _starts(counts: Sequence[int]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(np.array(counts, dtype=np.int64))]).astype(np.int64)
