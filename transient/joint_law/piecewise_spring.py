"""A one-sided spring of straight pieces."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw
from transient.joint_law.straight_path import closed_part


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`: each change of slope is a spring of its own that begins at its kink."""
    end[0], mean[0] = 0.0, 0.0
    for piece in range(value.size - 1):
        a, b = before[0] - piece * value[0], after[0] - piece * value[0]
        first, last = closed_part(a, b)
        end[0] += value[1 + piece] * max(b, 0.0)
        mean[0] += value[1 + piece] * 0.5 * (max(a, 0.0) + max(b, 0.0)) * (last - first)


TRANSIENT_LAWS.register(TransientLaw(name="piecewise_spring", force=force))
