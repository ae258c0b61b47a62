"""A cubic spring."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, CompiledLaw, displacement_jacobian


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[0], slope[1], slope[2] = 3.0 * parameters[0] * u**2, 0.0, u**3
    return float(parameters[0] * u**3)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    n = u.shape[1]
    slope, by_displacement = np.empty(3), np.empty(n)
    for k in range(n):
        out.force[0, k] = instant(u[0, k], 0.0, parameters, slope) - reference[0] * u[0, k]
        by_displacement[k] = slope[0] - reference[0]
        if want >= PARAMETERS:
            out.by_parameter[0, 0, k] = slope[2]
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="cubic", force=force, instant=instant))
