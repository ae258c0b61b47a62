"""The friction of Canudas de Wit and others, exact at the mean velocity of a step."""

from math import exp

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import WITNESSES, Witness


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`: z tends to sgn(v) g / sigma_0 by an exponential of the path."""
    stiffness, limit, static, stribeck, bristle, viscous = value[0], value[1], value[2], value[3], value[4], value[5]
    velocity = (after[0] - before[0]) / step
    reach = (limit + (static - limit) * exp(-((velocity / stribeck) ** 2))) / stiffness
    ahead = reach if velocity >= 0.0 else -reach
    path = abs(after[0] - before[0]) / reach
    decay = exp(-path)
    start = before[0] - slider[0]
    away = start - ahead
    z = ahead + away * decay
    moved[0], moved[1] = after[0] - z, reach
    # The mean of an exponential, by its series where the path is short.
    share = (1.0 - decay) / path if path > 1e-5 else 1.0 - 0.5 * path
    mean[0] = stiffness * (ahead + away * share) + bristle * (z - start) / step + viscous * velocity
    rate = velocity - abs(velocity) * z / reach
    end[0] = stiffness * z + bristle * rate + viscous * velocity


WITNESSES.register(Witness(name="lugre", force=force))
