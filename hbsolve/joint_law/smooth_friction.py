"""Coulomb's friction with a smooth step."""

from math import tanh
from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    limit, scale = parameters[0], parameters[1]
    share = tanh(velocity / scale)
    steepness = (1.0 - share * share) / scale
    slope[0], slope[1] = 0.0, limit * steepness
    slope[2], slope[3] = share, -limit * steepness * velocity / scale
    return float(limit * share)


FORCES.register(instant_law("smooth_friction", instant, uses_displacement=False, uses_velocity=True))
