"""Damping of a structure by its ``[structure.damping]``: Rayleigh's, by factors or by the first stuck mode."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from reduction.errors import JointError
from reduction.file.structure_file import StructureMatrices
from reduction.jointed_system import Joint
from reduction.stuck import stuck_damping
from study.case.damping import stuck_at_rest
from study.kind.plain.table import RayleighTable

Matrix = Float[NDArray[np.float64], "r r"]


def rayleigh(table: RayleighTable, matrices: StructureMatrices, joints: Sequence[Joint]) -> Matrix:
    """C = alpha M + beta K [N s/m].

    Parameters
    ----------
    table
        The factors, or the ratio on the first mode with all contacts stuck.
    matrices
        Of the structure.
    joints
        All joints on it.

    Raises
    ------
    JointError
        The file holds damping of its own, and the table does not say that it takes its place.
    """
    if matrices.has_damping and not table.replace:
        says = "" if table.ratio is None else f"ratio = {table.ratio:g}: "
        raise JointError(
            f"{says}the file of the structure holds damping of its own: add replace = true to put this in its place, "
            "or remove [structure.damping]"
        )
    mass, stiffness = matrices.mass, matrices.stiffness
    if table.ratio is not None:
        return stuck_damping(mass, stiffness, stuck_at_rest(stiffness, joints), table.ratio)
    return np.asarray((table.mass_factor or 0.0) * mass + (table.stiffness_factor or 0.0) * stiffness)
