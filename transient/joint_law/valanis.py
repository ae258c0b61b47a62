"""The hysteresis of Valanis, in the force as Gaul and Lenz write it."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.rate_equation import follow as follow_rate
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw


@compiled
def rate(state: float, kappa: float, ratio: float) -> float:
    """Derivative of y by lambda u with y = lambda (f - E_t u) / E_0, for a motion in the positive direction."""
    return (1.0 - state) / (1.0 - kappa * state) - ratio


follow = follow_rate(__name__, rate=rate)


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`; the slider is u - (f - E_t u) / (E_0 - E_t)."""
    E_0, E_t, F, kappa = value[0], value[1], value[2], value[3]
    factor = E_0 * (E_0 - E_t) / (F * (E_0 - kappa * E_t))
    sign = 1.0 if after[0] >= before[0] else -1.0
    stretch = factor * (E_0 - E_t) / E_0
    limit = (E_0 - E_t) / (E_0 - kappa * E_t)
    start = min(max(sign * stretch * (before[0] - slider[0]), -limit), limit)
    last, average = follow(start, factor * abs(after[0] - before[0]), 1.0 - kappa, kappa, E_t / E_0)
    moved[0] = after[0] - sign * last / stretch
    end[0] = E_t * after[0] + E_0 / factor * sign * last
    mean[0] = 0.5 * E_t * (before[0] + after[0]) + E_0 / factor * sign * average


TRANSIENT_LAWS.register(TransientLaw(name="valanis", force=force))
