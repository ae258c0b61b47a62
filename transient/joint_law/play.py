"""A spring beyond a clearance on either side: two stops against each other."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw
from transient.joint_law.straight_path import closed_part


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    end[0], mean[0] = 0.0, 0.0
    for side in (1.0, -1.0):
        a, b = value[0] * (side * before[0] - value[1]), value[0] * (side * after[0] - value[1])
        first, last = closed_part(a, b)
        end[0] += side * max(b, 0.0)
        mean[0] += side * 0.5 * (max(a, 0.0) + max(b, 0.0)) * (last - first)


TRANSIENT_LAWS.register(
    TransientLaw(
        name="play",
        force=force,
        stuck_stiffness=lambda joint: [joint.stiffness],
        normal_terms=lambda joint: joint.stiffness * joint.gap,
    )
)
