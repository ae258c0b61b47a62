r"""The hysteresis of Bouc and Wen along a straight path from instant to instant.

With r and w of `hbsolve.joint_law.hysteretic_joint`,

.. math:: \frac{dw}{dx} = \frac{1 - r^n}{1 - r} \quad (r > 0), \qquad
          \frac{dw}{dx} = \frac{1 + (2 \beta - 1) |r|^n}{1 + |r|} \quad (r < 0) .

The rate lies between 1/2 and the larger of n and beta, so that the Runge-Kutta rule integrates a path of any length in
a few parts.
"""

from math import exp, expm1, log, log1p
from typing import Any

import numpy as np

from fe.compiled import compiled
from hbsolve.joint_law.hysteretic_joint import add_shape, begin, finish
from hbsolve.joint_law.rate_state import rate_law
from hbsolve.joint_law.registry import FORCES

#: Number of parts of a step: at 128 instants per period the rule is then as accurate as a thousand instants are.
PARTS = 4
#: Value of 1 - r below which the rate equals its limit to the last digit.
LEAST = 1e-17


@compiled
def rate(w: float, n: float, beta: float) -> tuple[float, float, float, float]:
    """dw/dx and its derivatives by w, n and beta."""
    left = exp(-w)  # 1 - r
    r = -expm1(-w)
    if r == 0.0:
        return 1.0, 1.0 if n > 1.0 else (0.0 if w >= 0.0 else 2.0 - 2.0 * beta), 0.0, 0.0
    if left < LEAST:
        return n, 0.0, 1.0, 0.0
    if r > 0.0:
        logarithm = log1p(-left) if left < 0.5 else log(r)
        power = exp(n * logarithm)
        value = -expm1(n * logarithm) / left
        return value, value - n * power / r, -power * logarithm / left, 0.0
    logarithm = log(-r)
    power, rho = exp(n * logarithm), 2.0 * beta - 1.0
    value = (1.0 + rho * power) / left
    return value, value + rho * n * power / r, rho * power * logarithm / left, 2.0 * power / left


@compiled
def step(
    before: float, after: float, velocity: float, state: Any, parameters: Any, value: Any, slope: Any
) -> None:  # fmt: skip
    """See `hbsolve.joint_law.rate_state`."""
    n, beta = parameters[3], parameters[4]
    sign, reach, start, x = begin(before, after, state, parameters)
    w0 = -log1p(-start)
    w, h = w0, x / PARTS
    # Derivatives of w and of the increments of the rule by w at the start, x, n and beta.
    by, total_by, last_by, stage_by = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4)
    by[0] = 1.0
    for _ in range(PARTS):
        total, last = 0.0, 0.0
        total_by[:] = 0.0
        last_by[:] = 0.0
        for stage in range(4):
            share = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            weight = 1.0 / 6.0 if stage in (0, 3) else 1.0 / 3.0
            g, g_w, g_n, g_beta = rate(w + share * last, n, beta)
            for c in range(4):
                stage_by[c] = h * g_w * (by[c] + share * last_by[c])
            stage_by[1] += g / PARTS
            stage_by[2] += h * g_n
            stage_by[3] += h * g_beta
            last = h * g
            last_by[:] = stage_by
            total += weight * last
            for c in range(4):
                total_by[c] += weight * last_by[c]
        w += total
        for c in range(4):
            by[c] += total_by[c]
    left = exp(-w)
    finish(
        after, sign, reach, start, x, -expm1(-w), left * by[0] * exp(w0), left * by[1], parameters, value, slope
    )  # fmt: skip
    add_shape(7, left * by[2], sign, reach, parameters, slope)
    add_shape(8, left * by[3], sign, reach, parameters, slope)


FORCES.register(rate_law("bouc_wen", step))
