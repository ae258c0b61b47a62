"""Whether a reduced model holds all the lowest fixed-interface modes, and how well it knows them."""

import numpy as np

from fe.mode_check import ModeCheck, check_modes
from fe.sparse.solver import UnknownInertia
from fe.sparse.symmetric_part import part
from fe.system import LinearSystem
from reduction.errors import RomError
from reduction.rom import ReducedModel


def check_fixed_interface_modes(system: LinearSystem, rom: ReducedModel) -> ModeCheck:
    """Residuals of the fixed-interface modes of a reduced model, and a count of those it should have.

    It factorises twice, once for the residuals and once for the count: more than half of what the reduction took.

    Parameters
    ----------
    system
        The system that was reduced.
    rom
        The reduced model; it keeps at least one mode.

    Raises
    ------
    RomError
        The model was not made from this system, has no modes, or the count proves nothing, whatever the shift.
    """
    if system.n_node != rom.n_node or not np.array_equal(system.free, rom.free):
        raise RomError(
            f"the reduced model of {len(rom.free)} degrees of freedom was not made from this system of {system.n_dof}: "
            "give the system that was reduced"
        )
    if rom.n_boundary == rom.n_dof:
        raise RomError("the reduced model keeps no fixed-interface modes: there is nothing to check")
    boundary = np.searchsorted(rom.free, 3 * rom.boundary_node + rom.boundary_direction)
    inner = np.setdiff1d(np.arange(system.n_dof), boundary)
    try:
        return check_modes(
            part(system.stiffness, inner).tocsr(),
            part(system.mass, inner).tocsr(),
            (2 * np.pi * rom.fixed_interface_frequency) ** 2,
            rom.recovery[inner, rom.n_boundary :],
        )
    except UnknownInertia as error:
        raise RomError(f"the fixed-interface modes cannot be counted ({error}): reduce without a check") from error
