"""A curved contact: a one-sided force that grows with a power of the indentation."""

from math import log
from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    stiffness, reference, exponent, gap = parameters[0], parameters[1], parameters[2], parameters[3]
    share = (u - gap) / reference
    if share <= 0.0:
        slope[:] = 0.0
        return 0.0
    power = share**exponent
    slope[0], slope[1] = stiffness * exponent * power / share, 0.0
    slope[2] = reference * power
    slope[3] = stiffness * (1.0 - exponent) * power
    slope[4] = stiffness * reference * power * log(share)
    slope[5] = -slope[0]
    return float(stiffness * reference * power)


FORCES.register(instant_law("hertz", instant, opens=True))
