"""Named points of a blade, for the rig's blade and the plain blade."""

from typing import Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


class Outline(Protocol):
    """Dimensions that determine the points, as in `geometry.blade.Blade`."""

    @property
    def length(self) -> float:
        """Length from root block to tip [m]."""

    @property
    def thickness(self) -> float:
        """Thickness along y [m]."""

    @property
    def excitation_height(self) -> float:
        """Height z of the excitation point [m]."""


def named_points(blade: Outline) -> dict[str, Float[NDArray[np.float64], " 3"]]:
    """Points of the shaker's force ("excitation") and of the accelerometer ("response"), on the face at +y [m]."""
    return {
        "excitation": np.array([0.0, blade.thickness / 2, blade.excitation_height]),
        "response": np.array([0.0, blade.thickness / 2, blade.length]),
    }
