"""A spring and a dashpot beyond a clearance, on one side or on both."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, SEPARATED, STICK, CompiledLaw


@compiled
def add_side(sign: float, u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force of the stop at u = sign times the gap, positive along u; its slopes are added."""
    k, c, depth, gap = parameters[0], parameters[1], parameters[2], parameters[3]
    indentation, speed = sign * u - gap, sign * velocity
    if indentation <= 0.0:
        return 0.0
    grown = min(indentation / depth, 1.0)
    force = k * indentation + c * grown * speed
    if force <= 0.0:
        return 0.0
    by_indentation = k + (c * speed / depth if indentation < depth else 0.0)
    slope[0] += by_indentation
    slope[1] += c * grown
    slope[2] += sign * indentation
    slope[3] += sign * grown * speed
    slope[4] -= sign * c * speed * indentation / depth**2 if indentation < depth else 0.0
    slope[5] -= sign * by_indentation
    return float(sign * force)


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force of one side at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    slope[:6] = 0.0
    return add_side(1.0, u, velocity, parameters, slope)


@compiled
def instant_of_both(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """The same of both sides."""
    slope[:6] = 0.0
    return add_side(1.0, u, velocity, parameters, slope) + add_side(-1.0, u, velocity, parameters, slope)


@compiled
def write(
    sides: int, u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, sampling: Any, want: int, out: Any
) -> None:
    """One direction; see `hbsolve.joint_law.registry`."""
    n, nh = u.shape[1], sampling.evaluate.shape[0]
    slope, by_u, by_velocity, touches = np.empty(6), np.empty(n), np.empty(n), False
    for k in range(n):
        if sides == 1:
            value = instant(u[0, k], velocity[0, k], parameters, slope)
        else:
            value = instant_of_both(u[0, k], velocity[0, k], parameters, slope)
        out.force[0, k] = value - reference[0] * u[0, k]
        out.status[0, k] = STICK if value != 0.0 else SEPARATED
        touches = touches or value != 0.0
        by_u[k], by_velocity[k] = slope[0] - reference[0], slope[1] * omega
        if want >= PARAMETERS:
            out.by_frequency[0, k] = slope[1] * velocity[0, k] / omega
            for number in range(4):
                out.by_parameter[number, 0, k] = slope[2 + number]
    if want >= JACOBIAN and (touches or reference[0] != 0.0):
        out.active[0] = nh
        moved = by_u.reshape(-1, 1) * sampling.instants
        moved += by_velocity.reshape(-1, 1) * sampling.differentiate.T
        out.jacobian[0, :, :nh] = np.dot(sampling.project.T, moved)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One side; see `hbsolve.joint_law.registry`."""
    write(1, u, velocity, omega, reference, parameters, sampling, want, out)


@compiled
def force_of_both(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """Both sides; see `hbsolve.joint_law.registry`."""
    write(2, u, velocity, omega, reference, parameters, sampling, want, out)


FORCES.register(CompiledLaw(name="damped_stop", force=force, instant=instant, uses_velocity=True))
FORCES.register(CompiledLaw(name="damped_play", force=force_of_both, instant=instant_of_both, uses_velocity=True))
