"""A spring whose force is a power of the displacement."""

from math import log
from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, CompiledLaw, displacement_jacobian


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
        out.force[0, k] = instant(u[0, k], 0.0, parameters, slope) - reference[0] * u[0, k]
        by_displacement[k] = slope[0] - reference[0]
        if want >= PARAMETERS:
            for number in range(3):
                out.by_parameter[number, 0, k] = slope[2 + number]
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="power", force=force, instant=instant))
