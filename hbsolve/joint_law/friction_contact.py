r"""The friction contact: a unilateral normal spring and one or two tangents, each with its own limit mu N.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 6-8.
"""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, JACOBIAN, PARAMETERS, CompiledLaw
from hbsolve.joint_law.slider import slider_slopes, tangent_jacobian, write_slider
from hbsolve.joint_law.unilateral import normal_force, unilateral


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """Directions: the tangents, then the normal; see `hbsolve.joint_law.registry`."""
    kt, kn, mu, preload, gap = parameters[0], parameters[1], parameters[2], parameters[3], parameters[4]
    n_tangent, n = u.shape[0] - 1, u.shape[1]
    N, closed = np.empty(n), np.empty(n, np.int64)
    n_open = normal_force(u[n_tangent], kn, preload, gap, N, closed)
    v, D = u[n_tangent], reference[n_tangent]
    unilateral(n_tangent, v, closed, n_open, D, kn, preload, gap, 3, 1, 4, sampling, want, out)
    limit, event, sign = mu * N, np.empty(n, np.int64), np.empty(n)
    for d in range(n_tangent):
        write_slider(d, u[d], limit, kt, reference[d], start[d], by_multiplier[d], event, sign, closed, out)
        if want >= JACOBIAN:
            tangent_jacobian(
                d, n_tangent, event, sign, closed, kt, reference[d], mu * kn, by_multiplier[d], sampling, out
            )
        if want < PARAMETERS:
            continue
        for k in range(n):
            j, s = event[k], sign[k]
            if j < 0:
                out.by_start[d, d, k] = -kt
                out.by_parameter[0, d, k] = u[d, k] - out.slider[d, k]
                if not by_multiplier[d]:
                    continue
                j = 0
                out.by_start[d, d, k] = mu * N[0]
            # T = k_t (u - u_j) + s mu N_j
            out.by_parameter[0, d, k] = u[d, k] - u[d, j]
            out.by_parameter[2, d, k] = s * N[j]
            if closed[j]:
                out.by_parameter[1, d, k] = s * mu * (u[n_tangent, j] - gap)
                out.by_parameter[3, d, k] = s * mu
                out.by_parameter[4, d, k] = -s * mu * kn


@compiled
def step_slopes(before: Any, after: Any, velocity: Any, slider: Any, parameters: Any, out: Any) -> None:
    """See `hbsolve.joint_law.registry.CompiledLaw`."""
    kt, kn, mu, preload, gap = parameters[0], parameters[1], parameters[2], parameters[3], parameters[4]
    normal = len(after) - 1
    N = preload + kn * (after[normal] - gap)
    if N > 0.0:
        out[normal, normal] = kn
    for d in range(normal):
        slider_slopes(d, normal, d, after[d], slider[d], mu * max(N, 0.0), kt, mu * kn if N > 0.0 else 0.0, out)


FORCES.register(CompiledLaw(name="friction", force=force, instant=None, step_slopes=step_slopes))
