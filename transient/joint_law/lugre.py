"""The friction of Canudas de Wit and others, exact at the mean velocity of a step."""

from math import exp

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw


@compiled
def reach_at(value: Vector, velocity: float) -> float:
    """Stretch at which the bristles slide, g / sigma_0 [m]."""
    return float((value[1] + (value[2] - value[1]) * exp(-((velocity / value[3]) ** 2))) / value[0])


@compiled
def instant(value: Vector, u: float, velocity: float, slider: Vector) -> float:
    """See `transient.joint_law.registry`."""
    z = u - slider[0]
    rate = velocity - abs(velocity) * z / reach_at(value, velocity)
    return float(value[0] * z + value[4] * rate + value[5] * velocity)


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`: z tends to sgn(v) g / sigma_0 by an exponential of the path."""
    velocity = (after[0] - before[0]) / step
    reach = reach_at(value, velocity)
    ahead = reach if velocity >= 0.0 else -reach
    path = abs(after[0] - before[0]) / reach
    decay = exp(-path)
    start = before[0] - slider[0]
    away = start - ahead
    z = ahead + away * decay
    moved[0], moved[1] = after[0] - z, reach
    # The mean of an exponential, by its series where the path is short.
    share = (1.0 - decay) / path if path > 1e-5 else 1.0 - 0.5 * path
    mean[0] = value[0] * (ahead + away * share) + value[4] * (z - start) / step + value[5] * velocity
    end[0] = instant(value, after[0], velocity, moved)


TRANSIENT_LAWS.register(TransientLaw(name="lugre", force=force, instant=instant))
