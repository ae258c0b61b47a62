"""Structural damping of a joint: the mean of a power of the displacement over a step at one velocity."""

from math import pi, tanh

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import WITNESSES, Witness

#: Steps that are shorter than this share of the displacement are integrated by Simpson's rule [-].
NEAR = 1e-3


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    reference, power = value[2], value[3] + 1.0
    a, b = before[0], after[0]
    against = tanh((b - a) / (step * value[4]))
    largest = value[0] * value[1] * reference * 0.25 * pi * (power + 1.0) * against
    end[0] = largest * abs(b / reference) ** power
    if abs(b - a) > NEAR * (abs(a) + abs(b)):
        area = (b * abs(b / reference) ** power - a * abs(a / reference) ** power) / (power + 1.0)
        mean[0] = largest * area / (b - a)
    else:
        # Simpson's rule: the difference of the areas is round-off.
        middle = abs(0.5 * (a + b) / reference) ** power
        mean[0] = (largest * (abs(a / reference) ** power + 4.0 * middle) + end[0]) / 6.0


WITNESSES.register(Witness(name="structural_damper", force=force))
