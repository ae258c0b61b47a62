"""A linear dashpot."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, CompiledLaw, velocity_jacobian, write_damper_instant


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
        value = instant(0.0, velocity[0, k], parameters, slope)
        write_damper_instant(k, value, slope, velocity[0, k], omega, want, by_velocity, out)
    if want >= JACOBIAN:
        velocity_jacobian(by_velocity, sampling, out)


FORCES.register(CompiledLaw(name="viscous_damper", force=force, instant=instant, uses_velocity=True))
