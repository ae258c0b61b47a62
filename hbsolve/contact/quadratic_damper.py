"""Drag that grows with the square of the velocity."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.contact.law import JACOBIAN, PARAMETERS
from hbsolve.contact.pointwise import velocity_jacobian

#: In the order of `parameters`; fields of `reduction.jointed_system.QuadraticDamper`.
NAMES = ("damping",)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; the velocity is Omega du/d(Omega t), so the force grows with Omega squared."""
    c, speed = parameters[0], np.abs(velocity[0])
    out.force[0] = c * speed * velocity[0]
    if want >= JACOBIAN:
        velocity_jacobian(2.0 * c * speed * omega, sampling, out)
    if want >= PARAMETERS:
        out.by_parameter[0, 0] = speed * velocity[0]
        out.by_frequency[0] = 2.0 * c * speed * velocity[0] / omega
