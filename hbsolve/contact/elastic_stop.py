"""A one-sided elastic stop without friction."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.contact.law import SEPARATED, STICK
from hbsolve.contact.unilateral import normal_force, unilateral

#: In the order of `parameters`; fields of `reduction.jointed_system.ElasticStop`.
NAMES = ("stiffness", "gap")


@compiled
def force(
    u: Any, velocity: Any, omega: float, reference: Any, parameters: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """One direction; see `hbsolve.contact.law`."""
    n = u.shape[1]
    N, closed = np.empty(n), np.empty(n, np.int64)
    n_open = normal_force(u[0], parameters[0], 0.0, parameters[1], N, closed)
    for k in range(n):
        out.status[0, k] = STICK if closed[k] else SEPARATED
    unilateral(0, u[0], N, closed, n_open, reference[0], parameters[0], parameters[1], -1, 0, 1, sampling, want, out)
    if n_open == n and reference[0] == 0.0:
        out.active[0] = 0  # never touched: nothing there
