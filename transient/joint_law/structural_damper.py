"""Structural damping of a joint: the mean of a power of the displacement over a step at one velocity."""

from math import pi, tanh

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw

#: Steps that are shorter than this share of the displacement are integrated by Simpson's rule [-].
SHORT_STEP = 1e-3


@compiled
def instant(value: Vector, u: float, velocity: float, slider: Vector) -> float:
    """See `transient.joint_law.registry`."""
    power = value[3] + 1.0
    largest = value[0] * value[1] * value[2] * 0.25 * pi * (power + 1.0) * tanh(velocity / value[4])
    return float(largest * abs(u / value[2]) ** power)


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    reference, power = value[2], value[3] + 1.0
    a, b = before[0], after[0]
    velocity = (b - a) / step
    end[0] = instant(value, b, velocity, slider)
    if abs(b - a) > SHORT_STEP * (abs(a) + abs(b)):
        area = (b * abs(b / reference) ** power - a * abs(a / reference) ** power) / (power + 1.0)
        mean[0] = instant(value, reference, velocity, slider) * area / (b - a)
    else:
        # Simpson's rule: the difference of the areas is round-off.
        middle = instant(value, 0.5 * (a + b), velocity, slider)
        mean[0] = (instant(value, a, velocity, slider) + 4.0 * middle + end[0]) / 6.0


TRANSIENT_LAWS.register(TransientLaw(name="structural_damper", force=force, instant=instant))
