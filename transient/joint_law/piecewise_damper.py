"""A damper of straight pieces."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw


@compiled
def instant(value: Vector, u: float, velocity: float, slider: Vector) -> float:
    """See `transient.joint_law.registry`."""
    total = 0.0
    for piece in range(value.size - 1):
        total += value[1 + piece] * max(abs(velocity) - piece * value[0], 0.0)
    return total if velocity > 0.0 else -total


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    mean[0] = end[0] = instant(value, after[0], (after[0] - before[0]) / step, slider)


TRANSIENT_LAWS.register(TransientLaw(name="piecewise_damper", force=force, instant=instant))
