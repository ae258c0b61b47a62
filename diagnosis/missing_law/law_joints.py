"""A free-form law as joints of a model: piecewise linear springs and damper, and Jenkins cells."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.missing_law.basis import LawBasis
from reduction.jointed_system import JenkinsChain, Joint, PiecewiseDamper, PiecewiseSpring

Vector = Float[NDArray[np.float64], " b"]

#: Least stiffness of a cell times the reach, over the largest coefficient: a cell must have a stiffness [-].
MIN_STIFFNESS = 1e-9


def list_law_joints(name: str, row: Float[NDArray[np.float64], " r"], basis: LawBasis, values: Vector) -> list[Joint]:
    """Joints with the force of a law along a row.

    Parameters
    ----------
    name
        Prefix of their names.
    row
        Row of the displacement, shape (r,) [-].
    basis, values
        Basis functions and their coefficients, shape (b,) [N].
    """
    ahead, back, damping = basis.pieces(values)
    stiffness, limit = basis.cells(values)
    least = MIN_STIFFNESS * max(float(np.abs(values).max()), 1e-300) / basis.reach
    joints: list[Joint] = [
        PiecewiseSpring(name=f"{name} ahead", direction=row, width=basis.width, stiffness=tuple(ahead)),
        PiecewiseSpring(name=f"{name} back", direction=-row, width=basis.width, stiffness=tuple(back)),
        PiecewiseDamper(name=f"{name} damper", direction=row, width=basis.width_of_speed, damping=tuple(damping)),
    ]
    used = limit > 0
    if used.any():
        joints.append(
            JenkinsChain(
                name=f"{name} cells", direction=row, tangential_stiffness=tuple(np.maximum(stiffness[used], least)),
                limit_force=tuple(limit[used]),
            )
        )  # fmt: skip
    return joints
