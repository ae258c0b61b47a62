r"""The hysteresis of Valanis, exact along a straight path from instant to instant.

With r and w of `hbsolve.joint_law.hysteretic_joint` the equation of Gaul and Lenz is

.. math:: \frac{dr}{dx} = \frac{1 - r}{1 - a r}, \qquad (1 - a)\, w + a\, (1 - e^{-w}) = x + \mathrm{const}, \qquad
          a = \frac{\kappa\, (k - k_s)}{k - \kappa k_s}
"""

from math import exp, expm1, log1p
from typing import Any

from fe.compiled import compiled
from hbsolve.joint_law.hysteretic_joint import add_shape, begin, finish
from hbsolve.joint_law.rate_state import rate_law
from hbsolve.joint_law.registry import FORCES

#: Largest number of Newton steps; the method converges from one side, in fewer than ten.
MAX_NEWTON = 60


@compiled
def step(
    before: float, after: float, velocity: float, state: Any, parameters: Any, value: Any, slope: Any
) -> None:  # fmt: skip
    """See `hbsolve.joint_law.rate_state`."""
    k, slip, kappa = parameters[0], parameters[1], parameters[3]
    sign, reach, start, x = begin(before, after, state, parameters)
    below = k - kappa * slip
    a = kappa * (k - slip) / below
    w0 = -log1p(-start)
    target = (1.0 - a) * w0 - a * expm1(-w0) + x
    w = max(w0, (target - a) / (1.0 - a))
    for _ in range(MAX_NEWTON):
        move = (target - (1.0 - a) * w + a * expm1(-w)) / (1.0 - a + a * exp(-w))
        w += move
        if abs(move) <= 1e-15 * (1.0 + abs(w)):
            break
    left, left0 = exp(-w), exp(-w0)
    # Derivative of r by the constant of the equation.
    by = left / (1.0 - a + a * left)
    finish(
        after, sign, reach, start, x, -expm1(-w), by * (1.0 - a + a * left0) / left0, by, parameters, value, slope
    )  # fmt: skip
    by_a = by * ((w - w0) + expm1(-w) - expm1(-w0))
    add_shape(4, by_a * kappa * slip * (1.0 - kappa) / below**2, sign, reach, parameters, slope)
    add_shape(5, -by_a * kappa * k * (1.0 - kappa) / below**2, sign, reach, parameters, slope)
    add_shape(7, by_a * (k - slip) * k / below**2, sign, reach, parameters, slope)


FORCES.register(rate_law("valanis", step))
