"""A spring whose force is a power of the displacement."""

from math import log
from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    stiffness, reference, exponent = parameters[0], parameters[1], parameters[2]
    share = abs(u) / reference
    secant = share ** (exponent - 1.0)
    slope[0], slope[1] = stiffness * exponent * secant, 0.0
    slope[2] = u * secant
    slope[3] = -stiffness * (exponent - 1.0) * u * secant / reference
    # u log(u) tends to zero with u.
    slope[4] = stiffness * u * secant * log(share) if share > 0.0 else 0.0
    return float(stiffness * u * secant)


FORCES.register(instant_law("power", instant))
