"""A curved contact: a one-sided force that grows with a power of the indentation."""

from math import log
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
        out.force[0, k] = instant(u[0, k], 0.0, parameters, slope) - reference[0] * u[0, k]
        out.status[0, k] = STICK if u[0, k] > parameters[3] else SEPARATED
        by_displacement[k] = slope[0] - reference[0]
        if want >= PARAMETERS:
            for number in range(4):
                out.by_parameter[number, 0, k] = slope[2 + number]
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="hertz", force=force, instant=instant))
