"""A spring and a slider in series."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw
from transient.joint_law.straight_path import slide


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    stiffness, limit = value[0], value[1]
    end[0], mean[0] = slide(stiffness * (before[0] - slider[0]), stiffness * (after[0] - before[0]), limit, limit)
    moved[0] = after[0] - end[0] / stiffness


TRANSIENT_LAWS.register(TransientLaw(name="jenkins", force=force))
