"""A spring beyond a clearance on either side."""

from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    stiffness, gap = parameters[0], parameters[1]
    side = 1.0 if u > gap else -1.0 if u < -gap else 0.0
    beyond = u - side * gap if side != 0.0 else 0.0
    slope[0], slope[1] = stiffness * abs(side), 0.0
    slope[2], slope[3] = beyond, -stiffness * side
    return float(stiffness * beyond)


FORCES.register(instant_law("play", instant, opens=True))
