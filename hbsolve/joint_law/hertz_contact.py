"""A curved contact: a one-sided force that grows with a power of the indentation."""

from math import log
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
    stiffness, reference, exponent, gap = parameters[0], parameters[1], parameters[2], parameters[3]
    share = (u - gap) / reference
    if share <= 0.0:
        slope[:] = 0.0
        return 0.0
    power = share**exponent
    slope[0], slope[1] = stiffness * exponent * power / share, 0.0
    slope[2] = reference * power
    slope[3] = stiffness * (1.0 - exponent) * power
    slope[4] = stiffness * reference * power * log(share)
    slope[5] = -slope[0]
    return float(stiffness * reference * power)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    n = u.shape[1]
    slope, by_displacement = np.empty(6), np.empty(n)
    for k in range(n):
        value = instant(u[0, k], 0.0, parameters, slope)
        write_spring_instant(k, value, slope, u[0, k], reference[0], want, by_displacement, out)
        out.status[0, k] = STICK if u[0, k] > parameters[3] else SEPARATED
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="hertz", force=force, instant=instant))
