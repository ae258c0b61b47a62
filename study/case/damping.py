"""A structure of a case with all its contacts that are closed at rest stuck."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from reduction.joint.law import Joint
from reduction.stuck import stuck_stiffness

Matrix = Float[NDArray[np.float64], "r r"]


def stuck_at_rest(stiffness: Matrix, joints: Sequence[Joint]) -> Matrix:
    """Stiffness of the structure with the springs of all sliders and of the contacts that are closed at rest [N/m]."""
    return stuck_stiffness(stiffness, [joint for joint in joints if not joint.open_at_rest])
