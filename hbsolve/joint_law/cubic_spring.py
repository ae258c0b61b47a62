"""A cubic spring."""

from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[0], slope[1], slope[2] = 3.0 * parameters[0] * u**2, 0.0, u**3
    return float(parameters[0] * u**3)


FORCES.register(instant_law("cubic", instant))
