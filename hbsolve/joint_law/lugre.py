r"""The friction of Canudas de Wit and others along a straight path from instant to instant.

.. math:: z_1 = s \bar r + (z_0 - s \bar r)\, e^{-|\Delta u| / \bar r}, \qquad s = \operatorname{sgn} \Delta u

with :math:`\bar r` the mean of :math:`r = g / \sigma_0` at both instants. The states are u - z, and r at the first.
"""

from math import exp, expm1
from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.rate_state import rate_law
from hbsolve.joint_law.registry import FORCES


@compiled
def step(
    before: float, after: float, velocity: float, state: Any, parameters: Any, value: Any, slope: Any
) -> None:  # fmt: skip
    """See `hbsolve.joint_law.rate_state`. Columns: u, v, u before, both states, then the six parameters."""
    stiffness, limit, static, stribeck = parameters[0], parameters[1], parameters[2], parameters[3]
    bristle, viscous = parameters[4], parameters[5]
    fall = exp(-((velocity / stribeck) ** 2))
    reach = (limit + (static - limit) * fall) / stiffness
    by_fall = (static - limit) * fall * 2.0 * velocity / stribeck**2 / stiffness
    r = slope[2]
    r[1], r[5], r[6], r[7], r[8] = (
        -by_fall, -reach / stiffness, (1.0 - fall) / stiffness, fall / stiffness, by_fall * velocity / stribeck,
    )  # fmt: skip

    # The first instant of the first period has no earlier r.
    weight = 0.5 if state[1] > 0.0 else 0.0
    mean = weight * state[1] + (1.0 - weight) * reach
    sign = 1.0 if after >= before else -1.0
    path = abs(after - before) / mean
    decay = exp(-path)
    start = before - state[0]
    away, z = (start - sign * mean) * decay, start * decay - sign * mean * expm1(-path)
    value[1], value[2] = after - z, reach
    by_mean = -sign * expm1(-path) + away * path / mean
    f, w = slope[0], slope[1]
    for column in range(len(w)):
        w[column] = -by_mean * (1.0 - weight) * r[column]
    w[0] += 1.0 + sign * away / mean
    w[2], w[3], w[4] = -sign * away / mean - decay, decay, -by_mean * weight

    speed = abs(velocity)
    rate = velocity - speed * z / reach
    value[0] = stiffness * z + bristle * rate + viscous * velocity
    by_z, by_r = stiffness - bristle * speed / reach, bristle * speed * z / reach**2
    for column in range(len(f)):
        f[column] = by_r * r[column] - by_z * w[column]
    f[0] += by_z
    f[1] += bristle * (1.0 - np.sign(velocity) * z / reach) + viscous
    f[5] += z
    f[9] += rate
    f[10] += velocity


FORCES.register(rate_law("lugre", step, uses_velocity=True))
