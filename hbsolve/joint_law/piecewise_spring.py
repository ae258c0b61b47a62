"""A one-sided spring with a piecewise linear force."""

from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.instant_law import instant_law
from hbsolve.joint_law.ramps import sum_ramps
from hbsolve.joint_law.registry import FORCES


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[:] = 0.0
    value, slope[0] = sum_ramps(u, parameters, slope[2:])
    return float(value)


FORCES.register(instant_law("piecewise_spring", instant))
