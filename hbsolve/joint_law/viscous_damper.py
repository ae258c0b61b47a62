"""A linear dashpot."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, CompiledLaw, velocity_jacobian


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[0], slope[1], slope[2] = 0.0, parameters[0], velocity
    return float(parameters[0] * velocity)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; the velocity is Omega du/d(Omega t)."""
    n = u.shape[1]
    slope, by_velocity = np.empty(3), np.empty(n)
    for k in range(n):
        out.force[0, k] = instant(0.0, velocity[0, k], parameters, slope)
        by_velocity[k] = slope[1] * omega
        if want >= PARAMETERS:
            out.by_parameter[0, 0, k] = slope[2]
            out.by_frequency[0, k] = slope[1] * velocity[0, k] / omega
    if want >= JACOBIAN:
        velocity_jacobian(by_velocity, sampling, out)


FORCES.register(CompiledLaw(name="viscous_damper", force=force, instant=instant, uses_velocity=True))
