"""Where a motion that repeats drags sliders to: friction remembers where they stood before, and nothing else."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_forces import joint_forces
from transient.joint_table import Packed


@compiled
def drag(joints: Packed, position: Float[NDArray[np.float64], "t d"], slider: Vector, step: float) -> Vector:
    """Sliders, shape (s,) [m], at the end of a period of prescribed motion.

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
