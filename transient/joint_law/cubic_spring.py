"""A cubic spring."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    a, b = before[0], after[0]
    end[0] = value[0] * b * b * b
    mean[0] = 0.25 * value[0] * (a + b) * (a * a + b * b)


TRANSIENT_LAWS.register(TransientLaw(name="cubic", force=force))
