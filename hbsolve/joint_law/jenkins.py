"""A spring and a slider in series with a constant limit."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, CompiledLaw
from hbsolve.joint_law.slider import slider_slopes, tangent_jacobian, write_slider


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    kt, limit = parameters[0], parameters[1]
    n = u.shape[1]
    event, sign, closed = np.empty(n, np.int64), np.empty(n), np.ones(n, np.int64)
    write_slider(0, u[0], np.full(n, limit), kt, reference[0], start[0], by_multiplier[0], event, sign, closed, out)
    if want >= JACOBIAN:
        tangent_jacobian(0, 0, event, sign, closed, kt, reference[0], 0.0, by_multiplier[0], sampling, out)
    if want >= PARAMETERS:
        for k in range(n):
            j = event[k]
            if j < 0 and not by_multiplier[0]:
                out.by_parameter[0, 0, k] = u[0, k] - out.slider[0, k]
                out.by_start[0, 0, k] = -kt
                continue
            if j < 0:
                j = 0
                out.by_start[0, 0, k] = limit
            out.by_parameter[0, 0, k] = u[0, k] - u[0, j]
            out.by_parameter[1, 0, k] = sign[k]


@compiled
def step_slopes(before: Any, after: Any, velocity: Any, slider: Any, parameters: Any, out: Any) -> None:
    """See `hbsolve.joint_law.registry.CompiledLaw`."""
    slider_slopes(0, 0, 0, after[0], slider[0], parameters[1], parameters[0], 0.0, out)


FORCES.register(CompiledLaw(name="jenkins", force=force, instant=None, step_slopes=step_slopes))
