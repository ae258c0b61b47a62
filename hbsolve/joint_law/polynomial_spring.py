"""A spring whose force is a polynomial of the displacement."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, CompiledLaw, displacement_jacobian

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
        out.force[0, k] = instant(u[0, k], 0.0, parameters, slope) - reference[0] * u[0, k]
        by_displacement[k] = slope[0] - reference[0]
        if want >= PARAMETERS:
            for number in range(COUNT):
                out.by_parameter[number, 0, k] = slope[2 + number]
    if want >= JACOBIAN:
        displacement_jacobian(by_displacement, sampling, out)


FORCES.register(CompiledLaw(name="polynomial", force=force, instant=instant))
