r"""Static equilibrium, the state from which an integration starts unless told otherwise."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from reduction.jointed_system import JointedSystem
from transient.errors import TransientError
from transient.law import joint_forces
from transient.march import solve_positions
from transient.state import TransientState
from transient.transition import ModalStructure, modal_structure

#: Equal parts in which the load is put on, so that sliders move as on a slow ramp.
N_PART = 50

#: Eigenvalues below this share of the largest are rigid-body motion.
RIGID = 1e-12


def equilibrium(system: JointedSystem | ModalStructure, load: float = 1.0) -> TransientState:
    """State at rest under the static load, put on in equal parts on the pre-loaded joints, sliders at 0 before.

    Parameters
    ----------
    system
        Structure, joints and loads, or its modal structure.
    load
        Scale of the static load [-].

    Raises
    ------
    TransientError
        A body that neither a support nor a sticking joint holds, or no equilibrium found.
    """
    structure = system if isinstance(system, ModalStructure) else modal_structure(system)
    table, shapes, eigenvalue = structure.table, structure.mode_shapes, structure.eigenvalue
    d = len(table.rows)
    static = load * (shapes.T @ structure.system.static)
    slider, position = np.zeros(table.n_slider), np.zeros(d)
    if not structure.system.static.any() and not _forces_at_rest(structure).any():
        return TransientState(
            displacement=shapes @ np.zeros(len(shapes)), velocity=np.zeros(len(shapes)), slider=slider
        )
    if not eigenvalue.min() > RIGID * eigenvalue.max():
        raise TransientError(
            f"the structure with its joints stuck has the eigenvalue {eigenvalue.min():g} 1/s^2, so a body is held "
            "by nothing: support it or give a start"
        )
    rows = structure.rows
    flexibility = np.ascontiguousarray(rows @ (rows / eigenvalue).T)
    free = rows @ (static / eigenvalue)
    at_rest = _forces_at_rest(structure)
    scale = float(np.abs(np.concatenate([free, flexibility @ at_rest])).max(initial=0.0))
    inverse, force, mean, end, moved = np.eye(d), np.zeros(d), np.zeros(d), np.zeros(d), slider.copy()
    for part in range(1, N_PART + 1) if d else ():
        share = part / N_PART
        after = position.copy()
        done = solve_positions(
            after, share * free, flexibility, structure.offset, True, position, slider, table.packed, np.inf, scale,
            inverse, force, mean, end, moved,
        )  # fmt: skip
        if done < 0:
            raise TransientError(
                f"no equilibrium was found at {100 * share:.0f} % of the static load: give a start, for instance from "
                "a slow ramp (`transient.history`)"
            )
        position, slider = after, moved.copy()
    modal = (static - rows.T @ force) / eigenvalue
    return TransientState(displacement=shapes @ modal, velocity=np.zeros(len(shapes)), slider=slider)


def _forces_at_rest(structure: ModalStructure) -> Float[NDArray[np.float64], " d"]:
    table = structure.table
    zero, end, mean = np.zeros(len(table.rows)), np.zeros(len(table.rows)), np.zeros(len(table.rows))
    slider = np.zeros(table.n_slider)
    joint_forces(table.packed, zero, zero, slider, 1.0, mean, end, slider.copy())
    return end
