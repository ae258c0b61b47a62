"""A spring beyond a clearance on either side."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import (
    FORCES,
    JACOBIAN,
    PARAMETERS,
    SEPARATED,
    STICK,
    CompiledLaw,
    displacement_jacobian,
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
        out.force[0, k] = instant(u[0, k], 0.0, parameters, slope) - reference[0] * u[0, k]
        out.status[0, k] = STICK if slope[0] > 0.0 else SEPARATED
        by_displacement[k] = slope[0] - reference[0]
        if want >= PARAMETERS:
            for number in range(2):
                out.by_parameter[number, 0, k] = slope[2 + number]
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="play", force=force, instant=instant))
