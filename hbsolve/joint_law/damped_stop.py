"""A spring and a dashpot beyond a clearance, on one side; `hbsolve.joint_law.damped_play` has both sides."""

from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES


@compiled
def add_side(sign: float, u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force of the stop at u = sign times the gap, positive along u; its slopes are added."""
    k, c, depth, gap = parameters[0], parameters[1], parameters[2], parameters[3]
    indentation, speed = sign * u - gap, sign * velocity
    if indentation <= 0.0:
        return 0.0
    grown = min(indentation / depth, 1.0)
    force = k * indentation + c * grown * speed
    if force <= 0.0:
        return 0.0
    by_indentation = k + (c * speed / depth if indentation < depth else 0.0)
    slope[0] += by_indentation
    slope[1] += c * grown
    slope[2] += sign * indentation
    slope[3] += sign * grown * speed
    slope[4] -= sign * c * speed * indentation / depth**2 if indentation < depth else 0.0
    slope[5] -= sign * by_indentation
    return float(sign * force)


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[:6] = 0.0
    return add_side(1.0, u, velocity, parameters, slope)


FORCES.register(instant_law("damped_stop", instant, uses_velocity=True, opens=True))
