"""What the virtual test bench makes of a system: modes with sticking contacts, and the sums that load cells read."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from reduction.jointed_system import FrictionContact, JointedSystem
from transient.joint_table import joint_table
from transient.transition import ModalStructure

Matrix = Float[NDArray[np.float64], "n m"]


def stuck_structure(system: JointedSystem) -> ModalStructure:
    """Modes with sticking contacts, full damping: such contacts then move exactly, whatever the step."""
    from scipy.linalg import eigh

    table = joint_table(system)
    contact = [isinstance(joint, FrictionContact) for joint in system.joints for _ in joint.directions]
    offset = np.where(contact, table.stuck_stiffness, 0.0)
    eigenvalue, shapes = eigh(system.stiffness + table.rows.T @ (offset[:, None] * table.rows), system.mass)
    return ModalStructure(
        system=system,
        table=table,
        mode_shapes=shapes,
        inverse_shapes=shapes.T @ system.mass,
        eigenvalue=eigenvalue,
        damping=shapes.T @ system.damping @ shapes,
        diagonal=False,
        offset=offset,
    )


def line_sums(system: JointedSystem) -> Matrix:
    """Tangential and normal sums over each line, over the directions of all joints, shape (4 or 0, d) [-]."""
    names = [joint.name.split()[0] for joint in system.joints if isinstance(joint, FrictionContact)]
    sums = np.zeros((2 * len(set(names)), sum(len(joint.directions) for joint in system.joints)))
    for row, line in enumerate(dict.fromkeys(names)):
        for contact, name in enumerate(names):
            if name == line:
                sums[2 * row, 2 * contact] = sums[2 * row + 1, 2 * contact + 1] = 1.0
    return sums
