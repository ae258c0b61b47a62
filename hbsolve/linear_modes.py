"""Modes of the linear reference of a balance."""

from typing import NamedTuple

import numpy as np

from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from reduction.array_type import Matrix, Vector

#: Size of off-diagonal modal damping, relative to the largest entry, up to which it is round-off of the modes.
DIAGONAL = 1e-9


class LinearModes(NamedTuple):
    """Modes with all contacts stuck and closed; r modes, d joint directions."""

    eigenvalue: Vector
    """Diagonal of Lambda, ascending, shape (r,) [1/s^2]."""
    damping: Matrix
    """C_m, shape (r, r) [1/s]."""
    shapes: Matrix
    """Phi, mass-normalised, shape (r, r) [kg^-1/2]."""
    rows: Matrix
    """B Phi, shape (d, r) [kg^-1/2]."""
    is_diagonal: bool
    """Whether C_m is diagonal."""


def compute_linear_modes(balance: HarmonicBalance) -> LinearModes:
    """Modes of the linear reference of a balance.

    Raises
    ------
    BalanceError
        Structural damping, which is defined only for periodic motions.
    """
    if balance.system.structural_damping is not None:
        raise BalanceError(
            "the structure has structural damping (a complex stiffness), which is defined only for periodic motions "
            "under a force: for stability and backbones give it as viscous damping, structural_damping / omega at "
            "the resonance of interest"
        )
    modes = balance.structure.stuck.modes
    shapes = modes.mode_shapes
    damping = shapes.T @ balance.system.damping @ shapes
    others = damping - np.diag(np.diag(damping))
    return LinearModes(
        eigenvalue=modes.lambda_,
        damping=damping,
        shapes=shapes,
        rows=np.ascontiguousarray(balance.structure.directions @ shapes),
        is_diagonal=bool(np.abs(others).max(initial=0.0) <= DIAGONAL * np.abs(damping).max(initial=0.0)),
    )
