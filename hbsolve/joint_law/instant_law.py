"""A law without memory: forces over a period and their derivatives, from the force at one instant.

A law defines `instant`, see `hbsolve.joint_law.registry.CompiledLaw`, and `instant_law` makes the rest.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from fe.compiled import compiled_template
from hbsolve.joint_law.registry import JACOBIAN, PARAMETERS, SEPARATED, STICK, CompiledLaw

# `instant_law` replaces these and `instant` for each law.
#: Whether the law reads displacement and velocity, and whether the joint is separated where its force is zero.
USES_DISPLACEMENT, USES_VELOCITY, OPENS = True, False, False


def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Placeholder for the force of a law at one instant."""
    raise NotImplementedError


@compiled_template
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`. The velocity is Omega du/d(Omega t)."""
    n, nh, p = u.shape[1], sampling.evaluate.shape[0], len(parameters)
    slope, by_u, by_velocity = np.empty(2 + p), np.empty(n), np.empty(n)
    acts = False
    for k in range(n):
        speed = velocity[0, k] if USES_VELOCITY else 0.0
        value = instant(u[0, k], speed, parameters, slope)
        out.force[0, k] = value - reference[0] * u[0, k]
        if USES_DISPLACEMENT:
            by_u[k] = slope[0] - reference[0]
        if USES_VELOCITY:
            by_velocity[k] = slope[1] * omega
        if OPENS:
            acts = acts or value != 0.0
            out.status[0, k] = STICK if value != 0.0 else SEPARATED
        if want >= PARAMETERS:
            for number in range(p):
                out.by_parameter[number, 0, k] = slope[2 + number]
            if USES_VELOCITY:
                out.by_frequency[0, k] = slope[1] * speed / omega
    if want < JACOBIAN or (OPENS and not acts and reference[0] == 0.0):
        return
    out.active[0] = nh
    jacobian, project = out.jacobian[0, :, :nh], sampling.project
    if USES_DISPLACEMENT and USES_VELOCITY:
        moved = by_u.reshape(-1, 1) * sampling.instants
        moved += by_velocity.reshape(-1, 1) * sampling.differentiate.T
        jacobian[:] = np.dot(project.T, moved)
    elif USES_VELOCITY:
        jacobian[:] = np.dot((project * by_velocity.reshape(-1, 1)).T, sampling.differentiate.T)
    else:
        jacobian[:] = np.dot((project * by_u.reshape(-1, 1)).T, sampling.instants)


def instant_law(
    name: str,
    instant: Callable[..., float],
    *,
    uses_displacement: bool = True,
    uses_velocity: bool = False,
    opens: bool = False,
) -> CompiledLaw:
    """Make a law with one direction from its compiled `instant`, as part of the module of `instant`.

    `opens` is whether the joint is separated where its force is zero, such as a stop.
    """
    facts = {"USES_DISPLACEMENT": uses_displacement, "USES_VELOCITY": uses_velocity, "OPENS": opens}
    made = force(instant.__module__, instant=instant, **facts)
    return CompiledLaw(name=name, force=made, instant=instant, uses_velocity=uses_velocity)
