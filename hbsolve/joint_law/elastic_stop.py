"""A one-sided elastic stop without friction."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import FORCES, SEPARATED, STICK, CompiledLaw
from hbsolve.joint_law.unilateral import normal_force, unilateral


@compiled
def instant(u: float, velocity: float, parameters: Any, slope: Any) -> float:
    """Force at one instant; see `hbsolve.joint_law.registry.CompiledLaw`."""
    touched = max(u - parameters[1], 0.0)
    slope[0] = parameters[0] if u > parameters[1] else 0.0
    slope[1], slope[2], slope[3] = 0.0, touched, -slope[0]
    return float(parameters[0] * touched)


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.joint_law.registry`."""
    n = u.shape[1]
    N, closed = np.empty(n), np.empty(n, np.int64)
    n_open = normal_force(u[0], parameters[0], 0.0, parameters[1], N, closed)
    for k in range(n):
        out.status[0, k] = STICK if closed[k] else SEPARATED
    kn, gap = parameters[0], parameters[1]
    unilateral(0, u[0], closed, n_open, reference[0], kn, 0.0, gap, -1, 0, 1, sampling, want, out)
    if n_open == n and reference[0] == 0.0:
        out.active[0] = 0  # never touched: the Jacobian is zero


FORCES.register(CompiledLaw(name="stop", force=force, instant=instant))
