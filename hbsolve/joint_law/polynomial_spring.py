"""A spring whose force is a polynomial of the displacement."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, CompiledLaw, displacement_jacobian, write_spring_instant

#: The lowest power, and the number of powers.
LOWEST, COUNT = 2, 4


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    force, power = 0.0, u
    slope[0], slope[1] = 0.0, 0.0
    for number in range(COUNT):
        slope[0] += (LOWEST + number) * parameters[number] * power
        power *= u
        slope[2 + number] = power
        force += parameters[number] * power
    return float(force)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    n = u.shape[1]
    slope, by_displacement = np.empty(2 + COUNT), np.empty(n)
    for k in range(n):
        value = instant(u[0, k], 0.0, parameters, slope)
        write_spring_instant(k, value, slope, u[0, k], reference[0], want, by_displacement, out)
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="polynomial", force=force, instant=instant))
