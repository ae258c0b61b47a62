"""A spring whose force is a polynomial of the displacement."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`.

    The mean of u^p from a to b is the sum of a^i b^(p - i) for i = 0 to p, over p + 1.
    """
    a, b = before[0], after[0]
    end[0] = b * b * (value[0] + b * (value[1] + b * (value[2] + b * value[3])))
    mean[0] = 0.0
    for power in range(2, 6):
        total = 0.0
        for i in range(power + 1):
            total += a**i * b ** (power - i)
        mean[0] += value[power - 2] * total / (power + 1)


TRANSIENT_LAWS.register(TransientLaw(name="polynomial", force=force))
