"""Joints as arrays, and calls of their laws from compiled code.

Laws over a period are large: they are called by their address (`hbsolve.function_address`). Laws at an instant are
small: compiled switches contain all of them.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from fe.compiled import compiled_switch
from hbsolve.function_address import caller, find_function_address
from hbsolve.joint_law import function_law as function
from hbsolve.joint_law.registry import FORCES, LawOutput
from hbsolve.sampling import sampling
from reduction.array_type import Real, Whole
from reduction.joint_law.joint_arrays import addresses, stack_parameters, starts
from reduction.joint_law.registry import Joint

#: Number of the law, `kind`, of a joint whose force is a user's function.
FUNCTION = -1


class JointTable(NamedTuple):
    """Joints as arrays, one row each; d directions, s sliders and p parameters in all."""

    kind: Whole
    force: Whole
    """Address in this process of the law's compiled force."""
    address: Whole
    """Address of a user's compiled function, 0 for other joints."""
    direction: Whole
    """First direction of each joint and, last, d: shape (n_joint + 1,)."""
    slider: Whole
    """First slider of each joint and, last, s."""
    parameter: Whole
    """First parameter of each joint and, last, p."""
    value: Real
    """Parameters, shape (p,)."""
    reference: Real
    """Stiffness of each direction in the linear structure, D of eq. 12, shape (d,) [N/m]."""
    uses_velocity: bool
    """Whether the force of any joint depends on a velocity."""


def make_joint_table(joints: Sequence[Joint]) -> JointTable:
    """Joints as arrays; a law without a force here is refused (`RegistryError`)."""
    values = [joint.parameter_values for joint in joints]
    return JointTable(
        kind=np.array([_find_kind(joint) for joint in joints], dtype=np.int64),
        force=list_force_addresses(joints),
        address=addresses(joints),
        direction=starts([len(joint.directions) for joint in joints]),
        slider=starts([joint.n_slider for joint in joints]),
        parameter=starts([len(item) for item in values]),
        value=np.array([value for item in values for value in item], dtype=np.float64),
        reference=np.array([stiffness for joint in joints for stiffness in joint.reference_stiffness]),
        uses_velocity=any(item.function is not None or FORCES[item.force_law].uses_velocity for item in joints),
    )


def _find_kind(joint: Joint) -> int:
    if joint.function is not None:
        return FUNCTION
    return FORCES.names().index(FORCES[joint.force_law].name)


def list_force_addresses(joints: Sequence[Joint]) -> Whole:
    """Addresses in this process of the compiled forces of joints, shape (n_joint,); laws are compiled on first use."""
    return np.array([_find_force_address(_find_kind(joint)) for joint in joints], dtype=np.int64)


@cache
def _find_force_address(kind: int) -> int:
    if kind == FUNCTION:
        return find_function_address(function.force, (0, *_ARGUMENTS))
    return find_function_address(list(FORCES)[kind].force, _ARGUMENTS)


def _make_example_arguments() -> tuple[Any, ...]:
    """Arguments of `CompiledLaw.force`, for their types."""
    row, plane, solid, flags = np.zeros(1), np.zeros((1, 1)), np.zeros((1, 1, 1)), np.zeros(1, dtype=np.int64)
    out = LawOutput(plane, solid, flags, solid, solid, plane, plane, np.zeros((2, 1), dtype=np.int64), flags)
    return plane, plane, 1.0, row, row, row, flags, sampling(1, 2), 0, out


_ARGUMENTS = _make_example_arguments()
#: ``call_force(address, arguments)`` fills the output of a law, see `CompiledLaw.force`.
call_force = caller(_ARGUMENTS)
#: The same for a user's function, whose address is the first of the arguments.
call_function_force = caller((0, *_ARGUMENTS))


class InstantTable(NamedTuple):
    """Joints as arguments of `instant_force`, one row each; p is the largest number of parameters."""

    kind: Whole
    address: Whole
    value: Real
    """Parameters, shape (n_joint, p)."""


def make_instant_table(joints: Sequence[Joint]) -> InstantTable:
    """Joints without memory, see `Joint.n_slider`, as arrays."""
    names = [item.name for item in _WITHOUT_MEMORY]
    kinds = [FUNCTION if joint.function is not None else names.index(joint.force_law) for joint in joints]
    return InstantTable(np.array(kinds, dtype=np.int64), addresses(joints), stack_parameters(joints))


_WITHOUT_MEMORY = [item for item in FORCES if item.instant is not None]
#: ``instant_force(kind, address, u, velocity, parameters, slope)`` [N]: see `CompiledLaw.instant`.
instant_force = compiled_switch(
    __name__,
    "u, velocity, parameters, slope",
    [item.instant for item in _WITHOUT_MEMORY if item.instant is not None],
    (function.instant, "address, u, velocity, parameters, slope"),
)

_WITH_MEMORY = [item for item in FORCES if item.step_slopes is not None]
#: ``step_slopes(kind, address, before, after, velocity, slider, parameters, out)``: see `CompiledLaw.step_slopes`.
step_slopes = compiled_switch(
    __name__,
    "before, after, velocity, slider, parameters, out",
    [item.step_slopes for item in _WITH_MEMORY if item.step_slopes is not None],
    (function.step_slopes, "address, before, after, velocity, slider, parameters, out"),
)


class SlopeTable(NamedTuple):
    """Switch that gives the slopes of each joint, and the number of its law there; shape (n_joint,) each."""

    has_memory: Whole
    """1 for `step_slopes`, 0 for `instant_force`."""
    kind: Whole


def make_slope_table(joints: Sequence[Joint]) -> SlopeTable:
    """Joints as arrays, for both switches."""
    with_memory, without = ([item.name for item in laws] for laws in (_WITH_MEMORY, _WITHOUT_MEMORY))
    has_memory = [joint.n_slider > 0 for joint in joints]
    kinds = [
        FUNCTION if joint.function is not None else (with_memory if slides else without).index(joint.force_law)
        for joint, slides in zip(joints, has_memory, strict=True)
    ]
    return SlopeTable(np.array(has_memory, dtype=np.int64), np.array(kinds, dtype=np.int64))
