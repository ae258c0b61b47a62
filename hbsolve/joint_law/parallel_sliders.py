"""Springs with sliders in parallel on one displacement."""

from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.registry import JACOBIAN, PARAMETERS
from hbsolve.joint_law.slider import slide, state, tangent_jacobian


@compiled
def parallel_sliders(
    u: Any, beyond: float, spring: Any, reach: Any, spring_by: Any, reach_by: Any, start: Any, by_multiplier: Any,
    sampling: Any, want: int, out: Any,
) -> None:  # fmt: skip
    """Write the force of one direction, see `hbsolve.joint_law.registry`.

    `spring` and `reach` are stiffness [N/m] and displacement at slip [m] of each slider, shape (s,), `spring_by` and
    `reach_by` their derivatives by each parameter, shape (s, p); `beyond` is the stiffness of all sliders, and of
    springs in parallel to them, less the reference [N/m]. The joint slips where the slider of the largest reach slips,
    and with it all others (macro-slip).
    """
    n = u.shape[1]
    event, sign, closed, active = np.empty(n, np.int64), np.empty(n), np.ones(n, np.int64), 0
    left, last = beyond - spring.sum(), reach.argmax()
    for k in range(n):
        out.force[0, k] = left * u[0, k]
    for i in range(len(spring)):
        w, own = out.slider[i], spring[i]
        slide(u[0], np.full(n, reach[i]), 1.0, start[i], by_multiplier[i], w, event, sign)
        for k in range(n):
            out.force[0, k] += own * (u[0, k] - w[k])
        for k in range(n if i == last else 0):  # where this slider slips, all slip
            out.status[0, k] = state(k, event[k], 1)
        if want >= JACOBIAN:
            tangent_jacobian(0, 0, event, sign, closed, own, own, 0.0, by_multiplier[i], sampling, out)
            active = max(active, out.active[0])
        if want >= PARAMETERS:
            for k in range(n):
                moves = event[k] >= 0 or by_multiplier[i]
                for p in range(spring_by.shape[1]):
                    by = spring_by[i, p] * (u[0, k] - w[k])
                    out.by_parameter[p, 0, k] += by + (own * sign[k] * reach_by[i, p] if moves else 0.0)
                if event[k] < 0:
                    out.by_start[i, 0, k] = own * reach[i] if by_multiplier[i] else -own
    if want >= JACOBIAN and beyond != 0.0:
        active = sampling.evaluate.shape[0]
        for a in range(active):
            out.jacobian[0, a, a] += beyond
    if want >= JACOBIAN:
        out.active[0] = active
