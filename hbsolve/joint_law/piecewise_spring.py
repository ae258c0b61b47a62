"""A one-sided spring of straight pieces."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.ramps import sum_ramps
from hbsolve.joint_law.registry import FORCES, JACOBIAN, CompiledLaw, displacement_jacobian, write_spring_instant


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[:] = 0.0
    value, slope[0] = sum_ramps(u, parameters, slope[2:])
    return float(value)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    n = u.shape[1]
    slope, by_displacement = np.empty(2 + len(parameters)), np.empty(n)
    for k in range(n):
        value = instant(u[0, k], 0.0, parameters, slope)
        write_spring_instant(k, value, slope, u[0, k], reference[0], want, by_displacement, out)
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="piecewise_spring", force=force, instant=instant))
