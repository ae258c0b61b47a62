"""A contact with two tangents under one elliptic limit."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.friction_contact import normal, normal_terms
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw
from transient.joint_law.straight_path import slide_coupled


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`: T_i / mu_i turns as the force of a circular limit does.

    With t_i = T_i / mu_i and w_i moving along T_i / k_i, the change of t_i is k_i / mu_i du_i less a multiple of t_i.
    """
    normal_start, normal_end, mean[2], closed, was_closed = normal(value, before[2], after[2])
    end[2] = normal_end
    stiffness, friction = (value[0], value[5]), (value[2], value[6])
    a, b = stiffness[0] / friction[0], stiffness[1] / friction[1]
    end[0], end[1], mean[0], mean[1] = slide_coupled(
        was_closed * a * (before[0] - slider[0]),
        was_closed * b * (before[1] - slider[1]),
        a * (after[0] - before[0]) * closed,
        b * (after[1] - before[1]) * closed,
        normal_start,
        normal_end,
    )
    for i in range(2):
        end[i] *= friction[i]
        mean[i] *= friction[i] * closed
        moved[i] = after[i] - end[i] / stiffness[i]


TRANSIENT_LAWS.register(TransientLaw(name="friction_ellipse", force=force, normal_terms=normal_terms))
