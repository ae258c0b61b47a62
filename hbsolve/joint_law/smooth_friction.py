"""Coulomb's friction with a smooth step."""

from math import tanh
from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, CompiledLaw, velocity_jacobian


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    limit, scale = parameters[0], parameters[1]
    share = tanh(velocity / scale)
    steepness = (1.0 - share * share) / scale
    slope[0], slope[1] = 0.0, limit * steepness
    slope[2], slope[3] = share, -limit * steepness * velocity / scale
    return float(limit * share)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; the velocity is Omega du/d(Omega t)."""
    n = u.shape[1]
    slope, by_velocity = np.empty(4), np.empty(n)
    for k in range(n):
        out.force[0, k] = instant(0.0, velocity[0, k], parameters, slope)
        by_velocity[k] = slope[1] * omega
        if want >= PARAMETERS:
            for number in range(2):
                out.by_parameter[number, 0, k] = slope[2 + number]
            out.by_frequency[0, k] = slope[1] * velocity[0, k] / omega
    if want >= JACOBIAN:
        velocity_jacobian(by_velocity, sampling, out)


FORCES.register(CompiledLaw(name="smooth_friction", force=force, instant=instant, uses_velocity=True))
