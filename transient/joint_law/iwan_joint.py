"""Segalman's four-parameter Iwan joint, as Jenkins elements in parallel."""

from fe.compiled import compiled
from reduction.array_type import Vector
from transient.joint_law.registry import TRANSIENT_LAWS, TransientLaw
from transient.joint_law.straight_path import slide

#: Number of cells of the law's grid, and end of the first one over the displacement of macro-slip [-].
CELLS, FIRST = 32, 1e-3


@compiled
def force(
    value: Vector, before: Vector, after: Vector, slider: Vector, step: float, mean: Vector, end: Vector, moved: Vector
) -> None:  # fmt: skip
    """See `transient.joint_law.registry`; Segalman's eqs 20 to 24 give phi_max, R and S."""
    stiffness, limit, chi, beta = value[0], value[1], value[2], value[3]
    inner = (chi + 1.0) / (chi + 2.0)
    phi_max = limit * (1.0 + beta) / (stiffness * (beta + inner))
    R = limit * (chi + 1.0) / (phi_max ** (chi + 2.0) * (beta + inner))
    end[0], mean[0] = 0.0, 0.0
    lower = 0.0
    for i in range(CELLS + 1):
        if i < CELLS:
            upper = phi_max * FIRST ** (1.0 - i / (CELLS - 1.0))
            spring = R * (upper ** (chi + 1.0) - lower ** (chi + 1.0)) / (chi + 1.0)
            reach = R * (upper ** (chi + 2.0) - lower ** (chi + 2.0)) / (chi + 2.0)
            lower = upper
        else:
            spring = limit / phi_max * beta / (beta + inner)
            reach = spring * phi_max
        start, increment = spring * (before[0] - slider[i]), spring * (after[0] - before[0])
        last, average = slide(start, increment, reach, reach)
        end[0] += last
        mean[0] += average
        moved[i] = after[0] - last / spring if spring > 0.0 else after[0]


TRANSIENT_LAWS.register(TransientLaw(name="iwan4", force=force))
