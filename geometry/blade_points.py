"""The named points of a blade, be it the rig's or the plain one."""

from typing import Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


class Outline(Protocol):
    """The dimensions that place the points, as in `geometry.blade.Blade`."""

    @property
    def length(self) -> float:
        """From root block to tip [m]."""

    @property
    def thickness(self) -> float:
        """Along y [m]."""

    @property
    def excitation_height(self) -> float:
        """Height z of the excitation point [m]."""


def named_points(blade: Outline) -> dict[str, Float[NDArray[np.float64], " 3"]]:
    """Where the shaker pushes ("excitation") and where the accelerometer sits ("response"), on the face at +y [m]."""
    return {
        "excitation": np.array([0.0, blade.thickness / 2, blade.excitation_height]),
        "response": np.array([0.0, blade.thickness / 2, blade.length]),
    }
