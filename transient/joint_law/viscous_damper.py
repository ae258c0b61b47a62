"""A linear dashpot."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import WITNESSES, Witness


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    mean[0] = value[0] * (after[0] - before[0]) / step
    end[0] = mean[0]


WITNESSES.register(Witness(name="viscous_damper", force=force))
