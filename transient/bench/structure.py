"""What the virtual test bench makes of a system: modes with sticking contacts, and the sums that load cells read."""

from dataclasses import replace

import numpy as np

from reduction.array_type import Matrix
from reduction.joint.friction_contact import friction_contacts
from reduction.jointed_system import JointedSystem
from transient.joint_table import joint_table
from transient.transition import ModalStructure, decompose


def stuck_structure(system: JointedSystem) -> ModalStructure:
    """Modes with sticking contacts, full damping: such contacts then move exactly, whatever the step."""
    table = joint_table(system)
    contact = [joint.normal_direction is not None for joint in system.joints for _ in joint.directions]
    offset = np.where(contact, table.stuck_stiffness, 0.0)
    return replace(decompose(system, table, offset), diagonal=False)


def line_sums(system: JointedSystem) -> Matrix:
    """Tangential and normal sums over each line, over the directions of all joints, shape (4 or 0, d) [-]."""
    names = [joint.name.split()[0] for joint in friction_contacts(system.joints)]
    sums = np.zeros((2 * len(set(names)), sum(len(joint.directions) for joint in system.joints)))
    for row, line in enumerate(dict.fromkeys(names)):
        for contact, name in enumerate(names):
            if name == line:
                sums[2 * row, 2 * contact] = sums[2 * row + 1, 2 * contact + 1] = 1.0
    return sums
