"""Structural damping of a joint: a force that grows with the displacement and has the sign of the velocity."""

from math import log, pi, tanh
from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    stiffness, loss, reference = parameters[0], parameters[1], parameters[2]
    exponent, scale = parameters[3], parameters[4]
    unit = 0.25 * pi * (exponent + 2.0)
    share = abs(u) / reference
    power = share**exponent
    step = tanh(velocity / scale)
    steepness = (1.0 - step * step) / scale
    force = unit * loss * stiffness * abs(u) * power * step
    slope[0] = unit * loss * stiffness * (exponent + 1.0) * power * step * np.sign(u)
    slope[1] = unit * loss * stiffness * abs(u) * power * steepness
    slope[2], slope[3] = force / stiffness, unit * stiffness * abs(u) * power * step
    slope[4] = -exponent * force / reference
    # u log(u) tends to zero with u.
    slope[5] = force / (exponent + 2.0) + (force * log(share) if share > 0.0 else 0.0)
    slope[6] = -slope[1] * velocity / scale
    return float(force)


FORCES.register(instant_law("structural_damper", instant, uses_velocity=True))
