"""Coulomb's friction with a smooth step."""

from math import tanh

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw


@compiled
def instant(value: Vector, u: float, velocity: float, slider: Vector) -> float:
    """See `transient.joint_law.registry`."""
    return float(value[0] * tanh(velocity / value[1]))


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    mean[0] = end[0] = instant(value, after[0], (after[0] - before[0]) / step, slider)


TRANSIENT_LAWS.register(TransientLaw(name="smooth_friction", force=force, instant=instant))
