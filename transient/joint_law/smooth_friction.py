"""Coulomb's friction with a smooth step."""

from math import tanh

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import WITNESSES, Witness


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    mean[0] = value[0] * tanh((after[0] - before[0]) / (step * value[1]))
    end[0] = mean[0]


WITNESSES.register(Witness(name="smooth_friction", force=force))
