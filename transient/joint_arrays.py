"""Joints as plain arrays, the form in which the compiled integration reads them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from reduction.array_type import Real, Whole
from reduction.joint_law.joint_arrays import addresses, stack_parameters, starts
from reduction.joint_law.registry import Joint
from reduction.jointed_system import JointedSystem
from transient.joint_law.function_law import force as function_force
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw

#: Number of the law of a joint whose force is a function of the user.
FUNCTION = -1
#: Of a joint whose law has no `instant`.
NONE = -2

Integers = Int[Whole, " joint"]


class JointArrays(NamedTuple):
    """Joints as compiled code reads them."""

    kind: Integers
    """Number of the law."""
    direction: Integers
    """First direction of each joint and, last, their number."""
    slider: Integers
    """First slider of each joint and, last, their number."""
    address: Integers
    """Of a user's function."""
    value: Float[Real, "joint p"]
    """Parameters."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TransientJointTable:
    """All joints of a system."""

    rows: Float[Real, "d r"]
    """Directions of all joints in order, shape (d, r) [-]."""
    stuck_stiffness: Float[Real, " d"]
    """Stiffness of each direction while its joint sticks and is closed, shape (d,) [N/m]."""
    packed: JointArrays
    """The arrays that compiled code reads."""
    n_slider: int
    """Number of sliders [-]."""
    instant: Integers
    """Number of the law of each joint among those with an `instant`, or `NONE`."""
    normal_terms: Float[Real, " d"]
    """|N_0| + k_n |g| in the normals of contacts and stops, shape (d,) [N]: normal forces that cancel each other leave
    round-off of the size of their terms, however small their sum."""
    slider_stiffness: Float[Real, " s"]
    """Stiffness that weighs each slider, shape (s,) [N/m]."""


def make_joint_table(system: JointedSystem) -> TransientJointTable:
    """Joints of a system in its order; a law that is unknown to the integration in time is a `RegistryError`."""
    laws, names = [_find_law(joint) for joint in system.joints], TRANSIENT_LAWS.names()
    stuck = [np.asarray(law.stuck_stiffness(joint)) for law, joint in zip(laws, system.joints, strict=True)]
    at_instants = [item.name for item in TRANSIENT_LAWS if item.instant is not None]
    terms = [np.zeros(0)]
    for number, (law, joint) in enumerate(zip(laws, system.joints, strict=True)):
        terms.append(np.append(np.zeros(len(stuck[number]) - 1), law.normal_terms(joint)))
    n_slider = [joint.n_slider for joint in system.joints]
    return TransientJointTable(
        rows=np.vstack([joint.directions for joint in system.joints]) if laws else np.zeros((0, system.n_dof)),
        stuck_stiffness=np.concatenate([np.zeros(0), *stuck]),
        packed=JointArrays(
            np.array([FUNCTION if law.name not in names else names.index(law.name) for law in laws], dtype=np.int64),
            starts([len(item) for item in stuck]),
            starts(n_slider),
            addresses(system.joints),
            stack_parameters(system.joints),
        ),
        n_slider=sum(n_slider),
        instant=np.array([_number(law, names, at_instants) for law in laws], dtype=np.int64),
        normal_terms=np.concatenate(terms),
        slider_stiffness=np.concatenate(
            [np.zeros(0), *(np.full(count, item[0]) for count, item in zip(n_slider, stuck, strict=True))]
        ),
    )


def _number(law: TransientLaw, names: Sequence[str], at_instants: Sequence[str]) -> int:
    if law.name not in names:
        return FUNCTION
    return at_instants.index(law.name) if law.name in at_instants else NONE


def _find_law(joint: Joint) -> TransientLaw:
    """The law of a joint; a user's own function, which has no second implementation, is integrated as it is."""
    if joint.function is not None:
        return TransientLaw(name=joint.kind, force=function_force)
    return TRANSIENT_LAWS[joint.force_law]
