"""A structure of a case with all its contacts stuck, and its damping by the first mode that it has then."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from reduction.errors import JointError
from reduction.file.structure_file import StructureMatrices
from reduction.joint.law import Joint
from reduction.stuck import stuck_damping, stuck_stiffness
from study.case.joint_table import DampingTable

Matrix = Float[NDArray[np.float64], "r r"]


def case_damping(table: DampingTable, structure: StructureMatrices, joints: Sequence[Joint]) -> Matrix:
    """C = alpha M + beta K with the ratio on the first mode of the structure with all its contacts stuck."""
    if structure.has_damping and not table.replace:
        raise JointError(
            f"ratio = {table.ratio:g} meets a file that holds damping of its own: add replace = true to put it in its "
            "place, or remove [damping]"
        )
    return stuck_damping(structure.mass, structure.stiffness, stuck_at_rest(structure.stiffness, joints), table.ratio)


def stuck_at_rest(stiffness: Matrix, joints: Sequence[Joint]) -> Matrix:
    """Stiffness of the structure with the springs of all sliders and of the contacts that are closed at rest [N/m]."""
    return stuck_stiffness(stiffness, [joint for joint in joints if not joint.open_at_rest])
