"""What laws of one direction share."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from reduction.joint.check import lock_numbers
from reduction.joint.law import Joint, Row


@dataclass(frozen=True, kw_only=True, eq=False)
class DirectedJoint(Joint):
    """A joint along one row; its parameters are checked against their bounds.

    Parameters
    ----------
    name
        What messages and results call it.
    direction
        Row of u, shape (r,) [-].

    Raises
    ------
    JointError
        A row that is not one, or a parameter that is not finite or outside its bounds.
    """

    name: str
    direction: Row

    def __post_init__(self) -> None:
        lock_numbers(self, "direction")
        for parameter in self.parameters:
            parameter.check(self)

    @property
    def directions(self) -> Float[NDArray[np.float64], "1 r"]:
        """The direction, shape (1, r) [-]."""
        return self.direction[None, :]
