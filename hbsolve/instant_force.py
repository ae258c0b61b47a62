"""Forces of joints without memory at one instant: what a march through time needs of the laws of the balance."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fe.compiled import compiled_switch
from hbsolve.contact import function
from hbsolve.contact.law import FORCES
from hbsolve.joint_table import FUNCTION, addresses
from reduction.joint.law import Joint

_KNOWN = [each for each in FORCES if each.instant is not None]


class InstantTable(NamedTuple):
    """Joints as `instant_force` takes them, a row each; p is the largest number of parameters."""

    kind: NDArray[np.int64]
    address: NDArray[np.int64]
    value: NDArray[np.float64]
    """Parameters, shape (n_joint, p)."""


def instant_table(joints: Sequence[Joint]) -> InstantTable:
    """Joints that remember nothing, see `Joint.n_slider`, as arrays."""
    names = [each.name for each in _KNOWN]
    value = np.zeros((len(joints), max((len(joint.parameters) for joint in joints), default=0)))
    for row, joint in zip(value, joints, strict=True):
        row[: len(joint.parameters)] = [getattr(joint, name) for name in joint.parameter_names]
    kinds = [FUNCTION if joint.function is not None else names.index(joint.force_law) for joint in joints]
    return InstantTable(kind=np.array(kinds, dtype=np.int64), address=addresses(joints), value=value)


#: ``instant_force(kind, address, u, velocity, parameters, slope)`` [N]: see `CompiledLaw.instant`.
instant_force = compiled_switch(
    __name__,
    "u, velocity, parameters, slope",
    [each.instant for each in _KNOWN if each.instant is not None],
    (function.instant, "address, u, velocity, parameters, slope"),
)
