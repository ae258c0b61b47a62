"""A spring beyond a clearance on either side."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import (
    FORCES,
    JACOBIAN,
    SEPARATED,
    STICK,
    CompiledLaw,
    displacement_jacobian,
    write_spring_instant,
)


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    stiffness, gap = parameters[0], parameters[1]
    side = 1.0 if u > gap else -1.0 if u < -gap else 0.0
    beyond = u - side * gap if side != 0.0 else 0.0
    slope[0], slope[1] = stiffness * abs(side), 0.0
    slope[2], slope[3] = beyond, -stiffness * side
    return float(stiffness * beyond)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    n = u.shape[1]
    slope, by_displacement = np.empty(4), np.empty(n)
    for k in range(n):
        value = instant(u[0, k], 0.0, parameters, slope)
        write_spring_instant(k, value, slope, u[0, k], reference[0], want, by_displacement, out)
        out.status[0, k] = STICK if slope[0] > 0.0 else SEPARATED
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="play", force=force, instant=instant))
