"""Common part of smooth hysteresis laws: force and derivatives from the ratio z / z_y of a law.

The state is the position of the far end of the yielding spring, u - z.

A motion in the negative direction is one in the positive direction of the mirrored joint: r = sgn(du) z / z_y, and the
path is x = abs(du) / z_y. The laws integrate w = -ln(1 - r), which grows without bound along a path while r tends to 1.
"""

from typing import Any

from fe.compiled import compiled

#: Largest r that differs from 1.
ALMOST = 1.0 - 1e-16


@compiled
def begin(before: float, after: float, state: Any, parameters: Any) -> tuple[float, float, float, float]:
    """The sign of the motion, z_y [m], r before the step, and x; a state beyond z_y is put on z_y."""
    reach = parameters[2] / (parameters[0] - parameters[1])
    sign = 1.0 if after >= before else -1.0
    start = sign * (before - state[0]) / reach
    return sign, reach, min(max(start, -1.0), ALMOST), abs(after - before) / reach


@compiled
def finish(
    after: float, sign: float, reach: float, start: float, path: float, last: float, by_start: float, by_path: float,
    parameters: Any, value: Any, slope: Any,
) -> None:  # fmt: skip
    """Write force and state after a step to r = `last`, and all derivatives but those of r by the shape parameters."""
    k, slip = parameters[0], parameters[1]
    z = sign * reach * last
    value[0], value[1] = slip * after + (k - slip) * z, after - z
    # A state that was put on the limit does not depend on its value before.
    by_start = by_start if -1.0 < start < ALMOST else 0.0
    f, w = slope[0], slope[1]
    by_reach = sign * (last - by_start * start - by_path * path)
    f[0], f[2], f[3] = by_path, by_start - by_path, -by_start
    f[4], f[5], f[6] = -by_reach * reach / (k - slip), by_reach * reach / (k - slip), by_reach / (k - slip)
    for column in range(7):
        w[column] = -f[column]
        f[column] *= k - slip
    w[0] += 1.0
    f[0] += slip
    f[4] += z
    f[5] += after - z


@compiled
def add_shape(column: int, by_shape: float, sign: float, reach: float, parameters: Any, slope: Any) -> None:
    """Add the effect of a shape parameter, by which r has the derivative `by_shape`, to its column of the slopes."""
    slope[1, column] -= sign * reach * by_shape
    slope[0, column] += (parameters[0] - parameters[1]) * sign * reach * by_shape
