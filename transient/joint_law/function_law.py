"""A user's own law, followed along the straight path of a step: it has no second writing, but another integrator."""

import numpy as np

from fe.compiled import compiled
from reduction.array_type import Vector
from reduction.joint_law.function_pointer import call_step

#: Number of parts of a step; the force is linear in each part.
PARTS_PER_STEP = 8


@compiled
def instant(address: int, value: Vector, u: float, velocity: float, slider: Vector) -> float:
    """See `transient.joint_law.registry`; the state is that of this instant already."""
    result = np.zeros((3 + slider.size + value.size, 1 + slider.size))
    call_step(address, u, velocity, slider, value, result, 0)
    return float(result[0, 0])


@compiled
def force(
    address: int, value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector,
    moved: Vector,
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    result = np.zeros((3 + slider.size + value.size, 1 + slider.size))
    moved[:] = slider
    way = after[0] - before[0]
    velocity = way / step if way != 0.0 else 0.0
    last = mean[0] = 0.0
    for part in range(PARTS_PER_STEP + 1):
        call_step(address, before[0] + part / PARTS_PER_STEP * way, velocity, moved, value, result, 0)
        for i in range(slider.size):
            moved[i] = result[0, 1 + i]
        if part:
            mean[0] += 0.5 * (last + result[0, 0]) / PARTS_PER_STEP
        last = result[0, 0]
    end[0] = last
