"""A one-sided elastic stop."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw
from transient.joint_law.straight_path import closed_part


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    a, b = value[0] * (before[0] - value[1]), value[0] * (after[0] - value[1])
    first, last = closed_part(a, b)
    end[0] = max(b, 0.0)
    mean[0] = 0.5 * (max(a, 0.0) + end[0]) * (last - first)


TRANSIENT_LAWS.register(
    TransientLaw(
        name="stop",
        force=force,
        stuck_stiffness=lambda joint: [joint.stiffness],
        normal_terms=lambda joint: abs(joint.stiffness * joint.gap),
    )
)
