"""Joints as plain arrays, the form in which the compiled march reads them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    JointedSystem,
    QuadraticDamper,
)

CONTACT, COULOMB_CONTACT, JENKINS, CUBIC, STOP, DAMPER = range(6)

#: Columns of `parameter`.
TANGENTIAL, NORMAL, FRICTION, PRELOAD, GAP, STRENGTH = range(6)

Integers = Int[NDArray[np.int64], " joint"]

#: kind, first direction, first slider, number of tangents, parameters: what compiled code takes.
Packed = tuple[Integers, Integers, Integers, Integers, Float[NDArray[np.float64], "joint 6"]]


@dataclass(frozen=True, kw_only=True, eq=False)
class JointTable:
    """All joints of a system.

    Parameters
    ----------
    rows
        Directions of all joints in order, shape (d, r) [-].
    stuck_stiffness
        Stiffness of each direction while its joint sticks and is closed, shape (d,) [N/m].
    packed
        The arrays that compiled code reads.
    n_slider
        Number of sliders [-].
    damper
        Which directions belong to a quadratic damper, with its damping, shape (d,) [N s^2/m^2].
    normal_terms
        |N_0| + k_n |g| in the normals of contacts and stops, shape (d,) [N]: normal forces that cancel each other leave
        round-off of the size of their terms, however small their sum.
    """

    rows: Float[NDArray[np.float64], "d r"]
    stuck_stiffness: Float[NDArray[np.float64], " d"]
    packed: Packed
    n_slider: int
    damper: Float[NDArray[np.float64], " d"]
    normal_terms: Float[NDArray[np.float64], " d"]


def joint_table(system: JointedSystem) -> JointTable:
    """Rows, stiffness and parameters of the joints of a system in its order."""
    kind, first, slider, tangent, parameter = [], [], [], [], []
    stiffness: list[float] = []
    damper: list[float] = []
    terms: list[float] = []
    n_slider = 0
    for joint in system.joints:
        code, values, stuck = _describe(joint)
        n_tangent = len(joint.tangents) if isinstance(joint, FrictionContact) else int(code == JENKINS)
        kind.append(code)
        first.append(len(stiffness))
        slider.append(n_slider)
        tangent.append(n_tangent)
        parameter.append(values)
        stiffness.extend(stuck)
        damper.extend([joint.damping if isinstance(joint, QuadraticDamper) else 0.0] * len(stuck))
        terms.extend([0.0] * (len(stuck) - 1) + [abs(values[PRELOAD]) + abs(values[NORMAL] * values[GAP])])
        n_slider += n_tangent
    integers = [np.array(column, dtype=np.int64) for column in (kind, first, slider, tangent)]
    return JointTable(
        rows=np.vstack([joint.directions for joint in system.joints]) if system.joints else np.zeros((0, system.n_dof)),
        stuck_stiffness=np.array(stiffness, dtype=np.float64),
        packed=(
            integers[0],
            integers[1],
            integers[2],
            integers[3],
            np.array(parameter, dtype=np.float64).reshape(-1, 6),
        ),
        n_slider=n_slider,
        damper=np.array(damper, dtype=np.float64),
        normal_terms=np.array(terms, dtype=np.float64),
    )


def _describe(joint: Joint) -> tuple[int, Sequence[float], Sequence[float]]:
    """Kind, row of `parameter`, and stiffness of each direction in stick."""
    match joint:
        case FrictionContact():
            coupled = joint.friction is Friction.COULOMB and len(joint.tangents) == 2
            values = (
                joint.tangential_stiffness,
                joint.normal_stiffness,
                joint.friction_coefficient,
                joint.preload,
                joint.gap,
                0.0,
            )
            stuck = [joint.tangential_stiffness] * len(joint.tangents) + [joint.normal_stiffness]
            return (COULOMB_CONTACT if coupled else CONTACT), values, stuck
        case JenkinsElement():
            return JENKINS, (joint.tangential_stiffness, 0, 0, 0, 0, joint.limit_force), [joint.tangential_stiffness]
        case CubicSpring():
            return CUBIC, (0, 0, 0, 0, 0, joint.stiffness), [0.0]
        case ElasticStop():
            return STOP, (0, joint.stiffness, 0, 0, joint.gap, 0), [joint.stiffness]
        case QuadraticDamper():
            return DAMPER, (0, 0, 0, 0, 0, joint.damping), [0.0]
