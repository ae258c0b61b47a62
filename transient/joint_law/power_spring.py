"""A spring whose force is a power of the displacement."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw

#: Steps that are shorter than this share of the displacement are integrated by Simpson's rule [-].
SHORT_STEP = 1e-3


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    stiffness, reference, exponent = value[0], value[1], value[2]
    a, b = before[0], after[0]
    end[0] = stiffness * b * abs(b / reference) ** (exponent - 1.0)
    if abs(b - a) > SHORT_STEP * (abs(a) + abs(b)):
        stored = abs(b / reference) ** (exponent + 1.0) - abs(a / reference) ** (exponent + 1.0)
        mean[0] = stiffness * reference**2 / (exponent + 1.0) * stored / (b - a)
    else:
        # Simpson's rule: the difference of the energies is round-off.
        middle = 0.5 * (a + b)
        first = stiffness * a * abs(a / reference) ** (exponent - 1.0)
        mean[0] = (first + 4.0 * stiffness * middle * abs(middle / reference) ** (exponent - 1.0) + end[0]) / 6.0


TRANSIENT_LAWS.register(TransientLaw(name="power", force=force))
