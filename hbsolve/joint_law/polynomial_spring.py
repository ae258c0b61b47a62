"""A spring whose force is a polynomial of the displacement."""

from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.registry import FORCES

#: The lowest power, and the number of powers.
LOWEST, COUNT = 2, 4


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    force, power = 0.0, u
    slope[0], slope[1] = 0.0, 0.0
    for number in range(COUNT):
        slope[0] += (LOWEST + number) * parameters[number] * power
        power *= u
        slope[2 + number] = power
        force += parameters[number] * power
    return float(force)


FORCES.register(instant_law("polynomial", instant))
