"""A structure with all its contacts stuck, and its damping by the first mode that it has then."""

from collections.abc import Sequence
from math import pi

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.damping import rayleigh_damping
from fe.dense_modes import dense_modes
from reduction.errors import JointError
from reduction.jointed_system import FrictionContact, Joint
from reduction.matrix_io import StructureMatrices
from reduction.stuck import stuck_stiffness
from study.solve_case import DampingTable

Matrix = Float[NDArray[np.float64], "r r"]

#: lambda / (lambda + sigma) of a rigid-body motion; that of the lowest elastic mode is 1/2.
RIGID = 1e-6
#: Share of omega^2 below which the structure's own stiffness counts for nothing in a mode.
FREE = 1e-9


def stuck_damping(table: DampingTable, structure: StructureMatrices, joints: Sequence[Joint]) -> Matrix:
    """C = alpha M + beta K with the ratio on the first mode of the structure with all its contacts stuck."""
    if structure.has_damping and not table.replace:
        raise JointError(
            f"ratio = {table.ratio:g} meets a file that holds damping of its own: add replace = true to put it in its "
            "place, or remove [damping]"
        )
    stuck = stuck_at_rest(structure.stiffness, joints)
    modes = dense_modes(structure.mass, stuck)
    first = int(np.argmax(1 - modes.shift * modes.mu > RIGID))
    omega = float(np.sqrt(modes.lambda_[first]))
    damping = rayleigh_damping(table.ratio, omega / (2 * pi))
    shape = modes.shapes[:, first] / np.sqrt(modes.mu[first])
    own = float(shape @ structure.stiffness @ shape)
    if own < FREE * omega**2:
        # The contacts alone hold the body: all damping is from its mass.
        return np.asarray(2 * damping.mass_factor * structure.mass)
    # Contacts carry a part of omega^2, so the structure's own stiffness is taken more often.
    return np.asarray(
        damping.mass_factor * structure.mass + damping.stiffness_factor * omega**2 / own * structure.stiffness
    )


def stuck_at_rest(stiffness: Matrix, joints: Sequence[Joint]) -> Matrix:
    """Stiffness of the structure with the springs of all sliders and of the contacts that are closed at rest [N/m]."""
    return stuck_stiffness(stiffness, [joint for joint in joints if not _is_open(joint)])


def _is_open(joint: Joint) -> bool:
    return isinstance(joint, FrictionContact) and joint.preload - joint.normal_stiffness * joint.gap <= 0
