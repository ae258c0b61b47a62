"""A damper of straight pieces."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.ramps import sum_ramps
from hbsolve.joint_law.registry import FORCES, JACOBIAN, CompiledLaw, velocity_jacobian, write_damper_instant


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[:] = 0.0
    value, slope[1] = sum_ramps(abs(velocity), parameters, slope[2:])
    if velocity < 0.0:
        value = -value
        slope[2:] *= -1.0
    return float(value)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; the velocity is Omega du/d(Omega t)."""
    n = u.shape[1]
    slope, by_velocity = np.empty(2 + len(parameters)), np.empty(n)
    for k in range(n):
        value = instant(0.0, velocity[0, k], parameters, slope)
        write_damper_instant(k, value, slope, velocity[0, k], omega, want, by_velocity, out)
    if want >= JACOBIAN:
        velocity_jacobian(by_velocity, sampling, out)


FORCES.register(CompiledLaw(name="piecewise_damper", force=force, instant=instant, uses_velocity=True))
