"""Conical groove in a pad, open downwards: width of its mouth, and conflicts of its dimensions."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.dimension import SMALLEST, in_millimetres

Radii = Float[NDArray[np.float64], "*k"]


def half_mouth(radius: Radii | float, lip_above_axis: float) -> Radii:
    """Half the width of the mouth of a groove whose lips are above its axis [m]."""
    return np.asarray(np.sqrt(np.asarray(radius) ** 2 - lip_above_axis**2))


def groove_problems(
    *,
    lip_above_axis: float,
    narrow_radius: float,
    wide_radius: float,
    width: float,
    width_name: str,
    narrow_at: str,
    sides: str,
) -> Iterator[str]:
    """Problems of a groove that is not open or not inside its pad.

    Parameters
    ----------
    lip_above_axis, narrow_radius, wide_radius, width
        Height of the lips above the axis, radii at both ends, and width of the pad [m].
    width_name, narrow_at, sides
        Names in the message for the field of the width, the narrow end, and the sides of the pad.
    """
    if lip_above_axis > narrow_radius - SMALLEST:
        yield (
            f"lip_above_axis = {in_millimetres(lip_above_axis)} closes the groove, whose radius is "
            f"{in_millimetres(narrow_radius)} at {narrow_at} (lower it or raise groove_radius)"
        )
    elif (mouth := float(half_mouth(wide_radius, lip_above_axis))) > width / 2 - SMALLEST:
        yield (
            f"{width_name} = {in_millimetres(width)} lets the groove, {in_millimetres(2 * mouth)} wide at its "
            f"mouth, break through {sides} (widen it or lower groove_radius)"
        )
