"""Forces of all joints over a step, by a compiled switch between their laws, and where a motion drags sliders."""

import numpy as np

from fe.compiled import compiled, compiled_switch
from reduction.array_type import Matrix, Vector
from transient.joint_arrays import NONE, Integers, JointArrays
from transient.joint_law.function_law import force as function_force
from transient.joint_law.function_law import instant as function_instant
from transient.joint_law.registry import ARGUMENTS, TRANSIENT_LAWS

_switch = compiled_switch(
    __name__, ARGUMENTS, [item.force for item in TRANSIENT_LAWS], (function_force, f"address, {ARGUMENTS}")
)

INSTANT = "value, u, velocity, slider"
_instant = compiled_switch(
    __name__,
    INSTANT,
    [item.instant for item in TRANSIENT_LAWS if item.instant is not None],
    (function_instant, f"address, {INSTANT}"),
)


@compiled
def joint_force(
    joint: int, joints: JointArrays, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector,
    end: Vector, moved: Vector,
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
    joints: JointArrays,
    before: Vector,
    after: Vector,
    slider: Vector,
    step: float,
    mean: Vector,
    end: Vector,
    moved: Vector,
) -> None:
    """`joint_force` of all joints."""
    for joint in range(joints.kind.size):
        joint_force(joint, joints, before, after, slider, step, mean, end, moved)


@compiled
def set_instant_forces(
    instant: Integers, joints: JointArrays, displacement: Matrix, velocity: Matrix, slider: Matrix, force: Matrix
) -> None:  # fmt: skip
    """Replace the forces of laws that depend on the velocity by those of each instant.

    instant: see `transient.joint_arrays.TransientJointTable`; displacement, velocity and force of all directions, shape
    (d, t); slider: all sliders, shape (t, s).
    """
    for joint in range(instant.size):
        if instant[joint] == NONE:
            continue
        i, j, m = joints.direction[joint], joints.slider[joint], joints.slider[joint + 1]
        for k in range(len(slider)):
            force[i, k] = _instant(
                instant[joint], joints.address[joint], joints.value[joint], displacement[i, k], velocity[i, k],
                slider[k, j:m],
            )  # fmt: skip


@compiled
def move_sliders(joints: JointArrays, position: Matrix, slider: Vector, step: float) -> Vector:
    """Sliders, shape (s,) [m], at the end of a period of prescribed motion; a second period moves them no further.

    The motion is that of all directions at the ends of all steps, shape (t, d) [m]; `slider` is where they stand
    before, `step` the length of a step [s].
    """
    moved, before = slider.copy(), slider.copy()
    mean, end = np.zeros(position.shape[1]), np.zeros(position.shape[1])
    # A step of no length: sliders move at once where the friction force exceeds its limit.
    joint_forces(joints, position[0], position[0], before, step, mean, end, moved)
    for number in range(1, len(position)):
        before[:] = moved
        joint_forces(joints, position[number - 1], position[number], before, step, mean, end, moved)
    return moved
