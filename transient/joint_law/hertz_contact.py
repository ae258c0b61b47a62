"""A curved contact: a one-sided force that grows with a power of the indentation."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw

#: Steps that are shorter than this share of the indentation are integrated by Simpson's rule [-].
SHORT_STEP = 1e-3


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    stiffness, reference, exponent, gap = value[0], value[1], value[2], value[3]
    a, b = max(before[0] - gap, 0.0), max(after[0] - gap, 0.0)
    end[0] = stiffness * reference * (b / reference) ** exponent
    if abs(b - a) > SHORT_STEP * (a + b):
        # The path is as long outside as it is; the force works on the part inside alone.
        stored = (b / reference) ** (exponent + 1.0) - (a / reference) ** (exponent + 1.0)
        mean[0] = stiffness * reference**2 / (exponent + 1.0) * stored / (after[0] - before[0])
    else:
        # Simpson's rule: the difference of the energies is round-off.
        first, middle = (a / reference) ** exponent, (0.5 * (a + b) / reference) ** exponent
        mean[0] = (stiffness * reference * (first + 4.0 * middle) + end[0]) / 6.0


TRANSIENT_LAWS.register(TransientLaw(name="hertz", force=force))
