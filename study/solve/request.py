"""What is asked of a solved model: curves, and what results show by name."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import DERIVATIVE

Row = Float[NDArray[np.float64], " r"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Output:
    """What the results show by name.

    Parameters
    ----------
    name
        As in the case.
    row
        Over the structure's degrees of freedom, shape (r,) [-].
    quantity
        displacement, velocity or acceleration [m, m/s, m/s^2].
    """

    name: str
    row: Row
    quantity: str

    @property
    def derivative(self) -> int:
        """How often the displacement is derived in time [-]."""
        return DERIVATIVE[self.quantity]


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """One curve that a case asks for.

    Parameters
    ----------
    parameter
        What varies along it, "frequency" or "level".
    first, last
        Its ends [rad/s, or - for levels].
    fixed
        The other one of the two.
    step
        The largest along it, in the unit of its ends; None leaves it to the solver.
    label
        For people: "level 3", "40 Hz".
    slider
        Where the sliders begin, shape (s,) [m]; springs without tension by default.
    """

    parameter: str
    first: float
    last: float
    fixed: float
    step: float | None
    label: str
    slider: Row | None = None
