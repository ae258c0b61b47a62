"""A damper with a piecewise linear force."""

from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.ramps import sum_ramps
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[:] = 0.0
    value, slope[1] = sum_ramps(abs(velocity), parameters, slope[2:])
    if velocity < 0.0:
        value = -value
        slope[2:] *= -1.0
    return float(value)


FORCES.register(instant_law("piecewise_damper", instant, uses_displacement=False, uses_velocity=True))
