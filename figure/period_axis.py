"""Histories over one period, and the axis that shows them."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.style import INK, Axes
from geometry.errors import InputError

Samples = Float[NDArray[np.float64], " n"]
QUARTERS = {0.0: "0", 0.25: "0.25", 0.5: "0.5", 0.75: "0.75", 1.0: "1"}


def refuse_unequal(whose: str, time: Samples, **values: Samples) -> None:
    """Refuse histories that do not have one value at each instant.

    Raises
    ------
    InputError
        Unequal shapes; the message has the name and the shape.
    """
    if time.ndim != 1 or time.size == 0:
        raise InputError(f"time of {whose} has the shape {time.shape}: give (n,) with at least one instant")
    for name, history in values.items():
        if history.shape != time.shape:
            raise InputError(
                f"{name} of {whose} has the shape {history.shape}: give {time.shape}, one value an instant"
            )


def closed(time: Samples, values: Samples) -> tuple[Samples, Samples]:
    """A history with its first value repeated one period later, to close it."""
    return np.r_[time, time[0] + 1.0], np.r_[values, values[0]]


def set_one_period(axes: Axes) -> None:
    """Scale of a horizontal axis from the start of a period to its end."""
    axes.set_xlim(0, 1)
    axes.set_xticks(list(QUARTERS), list(QUARTERS.values()))


def name_period(axes: Axes) -> None:
    """Label an axis over one period."""
    axes.set_xlabel("time / period [-]", color=INK)
