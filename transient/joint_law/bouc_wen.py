"""The hysteresis of Bouc and Wen."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.rate_equation import follow as follow_rate
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw


@compiled
def rate(state: float, exponent: float, shape: float) -> float:
    """Derivative of z / z_y by u / z_y for a motion in the positive direction."""
    size = min(abs(state), 1.0)
    return float(1.0 - size**exponent * (1.0 - shape + (shape if state > 0.0 else -shape)))


follow = follow_rate(__name__, rate=rate)


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`."""
    slip, yielding = value[1], value[0] - value[1]
    reach = value[2] / yielding
    # A motion in the negative direction is one in the positive direction of the mirrored joint.
    sign = 1.0 if after[0] >= before[0] else -1.0
    start = min(max(sign * (before[0] - slider[0]) / reach, -1.0), 1.0)
    last, average = follow(start, abs(after[0] - before[0]) / reach, 1.0 / value[3], value[3], value[4])
    end[0] = slip * after[0] + yielding * sign * reach * last
    moved[0] = after[0] - sign * reach * last
    mean[0] = 0.5 * slip * (before[0] + after[0]) + yielding * sign * reach * average


TRANSIENT_LAWS.register(TransientLaw(name="bouc_wen", force=force))
