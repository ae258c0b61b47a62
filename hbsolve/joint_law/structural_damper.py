"""Structural damping of a joint: force with the displacement, against the velocity."""

from math import log, pi, tanh
from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, CompiledLaw, write_damper_instant


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    stiffness, loss, reference = parameters[0], parameters[1], parameters[2]
    exponent, scale = parameters[3], parameters[4]
    unit = 0.25 * pi * (exponent + 2.0)
    share = abs(u) / reference
    power = share**exponent
    step = tanh(velocity / scale)
    steepness = (1.0 - step * step) / scale
    force = unit * loss * stiffness * abs(u) * power * step
    slope[0] = unit * loss * stiffness * (exponent + 1.0) * power * step * np.sign(u)
    slope[1] = unit * loss * stiffness * abs(u) * power * steepness
    slope[2], slope[3] = force / stiffness, unit * stiffness * abs(u) * power * step
    slope[4] = -exponent * force / reference
    # u log(u) vanishes with u.
    slope[5] = force / (exponent + 2.0) + (force * log(share) if share > 0.0 else 0.0)
    slope[6] = -slope[1] * velocity / scale
    return float(force)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; the velocity is Omega du/d(Omega t)."""
    n, nh = u.shape[1], sampling.evaluate.shape[0]
    slope, by_displacement, by_velocity = np.empty(7), np.empty(n), np.empty(n)
    for k in range(n):
        value = instant(u[0, k], velocity[0, k], parameters, slope)
        write_damper_instant(k, value, slope, velocity[0, k], omega, want, by_velocity, out)
        out.force[0, k] -= reference[0] * u[0, k]
        by_displacement[k] = slope[0] - reference[0]
    if want >= JACOBIAN:
        out.active[0] = nh
        moved = by_displacement.reshape(-1, 1) * sampling.instants
        moved += by_velocity.reshape(-1, 1) * sampling.differentiate.T
        out.jacobian[0, :, :nh] = np.dot(sampling.project.T, moved)


FORCES.register(CompiledLaw(name="structural_damper", force=force, instant=instant, uses_velocity=True))
