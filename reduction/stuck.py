"""A structure with all its sliders stuck."""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from reduction.joint import FrictionContact, JenkinsElement, Joint

Matrix = Float[NDArray[np.float64], "r r"]


def stuck_stiffness(stiffness: Matrix, joints: Iterable[Joint]) -> Matrix:
    """Stiffness with the springs of all sliders, and with all contacts closed, shape (r, r) [N/m].

    Parameters
    ----------
    stiffness
        Of the structure without its joints, shape (r, r) [N/m].
    joints
        Contacts and sliders count; all others add nothing.
    """
    stuck = np.array(stiffness)
    for joint in joints:
        if isinstance(joint, FrictionContact):
            stuck += joint.tangential_stiffness * joint.tangents.T @ joint.tangents
            stuck += joint.normal_stiffness * np.outer(joint.normal, joint.normal)
        elif isinstance(joint, JenkinsElement):
            stuck += joint.tangential_stiffness * np.outer(joint.direction, joint.direction)
    return stuck
