"""Forces of all joints over a step: the compiled switch between their laws."""

from fe.compiled import compiled, compiled_switch
from reduction.array_type import Vector
from transient.joint_table import Packed
from transient.law.function import force as function_force
from transient.law.witness import ARGUMENTS, WITNESSES

_switch = compiled_switch(
    __name__, ARGUMENTS, [item.force for item in WITNESSES], (function_force, f"address, {ARGUMENTS}")
)


@compiled
def joint_force(
    joint: int, joints: Packed, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector,
    moved: Vector,
) -> None:  # fmt: skip
    """Write mean and end force [N] of one joint's directions and the moved sliders [m] into the last three arguments.

    before, after: positions of all directions at both ends of the step, shape (d,) [m]; slider: all sliders before it,
    shape (s,) [m]; step: its length [s].
    """
    i, k = joints.direction[joint], joints.direction[joint + 1]
    j, m = joints.slider[joint], joints.slider[joint + 1]
    _switch(
        joints.kind[joint], joints.address[joint], joints.value[joint], before[i:k], after[i:k], slider[j:m], step,
        mean[i:k], end[i:k], moved[j:m],
    )  # fmt: skip


@compiled
def joint_forces(
    joints: Packed, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:
    """`joint_force` of all joints."""
    for joint in range(joints.kind.size):
        joint_force(joint, joints, before, after, slider, step, mean, end, moved)
