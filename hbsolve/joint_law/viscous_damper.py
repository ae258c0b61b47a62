"""A linear dashpot."""

from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[0], slope[1], slope[2] = 0.0, parameters[0], velocity
    return float(parameters[0] * velocity)


FORCES.register(instant_law("viscous_damper", instant, uses_displacement=False, uses_velocity=True))
