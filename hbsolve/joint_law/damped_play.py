"""A spring and a dashpot beyond a clearance on either side."""

from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.damped_stop import add_side
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[:6] = 0.0
    return add_side(1.0, u, velocity, parameters, slope) + add_side(-1.0, u, velocity, parameters, slope)


FORCES.register(instant_law("damped_play", instant, uses_velocity=True, opens=True))
