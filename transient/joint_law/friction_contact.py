"""The contact: a unilateral normal spring beside one tangent, or two with a limit each or with one limit."""

from typing import Any

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw
from transient.joint_law.straight_path import closed_part, slide, slide_coupled


@compiled
def normal(value: Vector, before: float, after: float) -> tuple[float, float, float, float, float]:
    """Normal force at both ends of the step and its mean [N], the part of it that is closed, and 1 if it was before."""
    start, end = value[3] + value[1] * (before - value[4]), value[3] + value[1] * (after - value[4])
    first, last = closed_part(start, end)
    closed = last - first
    start, end = max(start, 0.0), max(end, 0.0)
    # A contact that closes within the step starts without friction force, where it touches down.
    return start, end, 0.5 * (start + end) * closed, closed, 1.0 if first == 0.0 and closed > 0.0 else 0.0


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    n = slider.size
    stiffness, friction = value[0], value[2]
    normal_start, normal_end, mean[n], closed, was_closed = normal(value, before[n], after[n])
    end[n] = normal_end
    for i in range(n):
        end[i], mean[i] = slide(
            was_closed * stiffness * (before[i] - slider[i]),
            stiffness * (after[i] - before[i]) * closed,
            friction * normal_start,
            friction * normal_end,
        )
        mean[i] *= closed
        moved[i] = after[i] - end[i] / stiffness


@compiled
def coupled_force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    stiffness, friction = value[0], value[2]
    normal_start, normal_end, mean[2], closed, was_closed = normal(value, before[2], after[2])
    end[2] = normal_end
    end[0], end[1], mean[0], mean[1] = slide_coupled(
        was_closed * stiffness * (before[0] - slider[0]),
        was_closed * stiffness * (before[1] - slider[1]),
        stiffness * (after[0] - before[0]) * closed,
        stiffness * (after[1] - before[1]) * closed,
        friction * normal_start,
        friction * normal_end,
    )
    for i in range(2):
        mean[i] *= closed
        moved[i] = after[i] - end[i] / stiffness


def normal_terms(joint: Any) -> float:
    """See `transient.joint_law.registry.TransientLaw`."""
    return float(abs(joint.preload) + abs(joint.normal_stiffness * joint.gap))


TRANSIENT_LAWS.register(TransientLaw(name="friction", force=force, normal_terms=normal_terms))
TRANSIENT_LAWS.register(TransientLaw(name="coulomb", force=coupled_force, normal_terms=normal_terms))
