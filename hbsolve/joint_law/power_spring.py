"""A spring whose force is a power of the displacement."""

from math import log
from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, CompiledLaw, displacement_jacobian, write_spring_instant


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    stiffness, reference, exponent = parameters[0], parameters[1], parameters[2]
    share = abs(u) / reference
    secant = share ** (exponent - 1.0)
    slope[0], slope[1] = stiffness * exponent * secant, 0.0
    slope[2] = u * secant
    slope[3] = -stiffness * (exponent - 1.0) * u * secant / reference
    # u log(u) vanishes with u.
    slope[4] = stiffness * u * secant * log(share) if share > 0.0 else 0.0
    return float(stiffness * u * secant)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    n = u.shape[1]
    slope, by_displacement = np.empty(5), np.empty(n)
    for k in range(n):
        value = instant(u[0, k], 0.0, parameters, slope)
        write_spring_instant(k, value, slope, u[0, k], reference[0], want, by_displacement, out)
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="power", force=force, instant=instant))
