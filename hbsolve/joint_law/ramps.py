"""A sum of ramps that begin at evenly spaced points: a piecewise linear force."""

from typing import Any

from fe.compiled import compiled


@compiled
def sum_ramps(x: float, parameters: Any, slope: Any) -> tuple[float, float]:
    """Force at x and its slope by x, with `parameters` the width of a piece, then the changes of slope.

    `slope`, which arrives as zeros, receives the derivatives by all parameters.
    """
    force, steep = 0.0, 0.0
    for piece in range(len(parameters) - 1):
        ramp = x - piece * parameters[0]
        if ramp <= 0.0:
            break
        change = parameters[1 + piece]
        force += change * ramp
        steep += change
        slope[0] -= piece * change
        slope[1 + piece] = ramp
    return force, steep
