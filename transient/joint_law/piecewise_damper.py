"""A damper of straight pieces."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import WITNESSES, Witness


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    velocity, total = (after[0] - before[0]) / step, 0.0
    for piece in range(value.size - 1):
        total += value[1 + piece] * max(abs(velocity) - piece * value[0], 0.0)
    end[0] = total if velocity > 0.0 else -total
    mean[0] = end[0]


WITNESSES.register(Witness(name="piecewise_damper", force=force))
