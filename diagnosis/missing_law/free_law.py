"""A free law as joints of a model: springs and a damper of straight pieces, and Jenkins cells."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import EffectParameter
from diagnosis.missing_law.basis import GROUPS, LawBasis
from reduction.jointed_system import JenkinsChain, Joint, PiecewiseDamper, PiecewiseSpring

Vector = Float[NDArray[np.float64], " b"]

#: Least limit of a cell over the force of the law: a cell of the balance has a stiffness.
LEAST = 1e-9
#: Largest coefficient in sizes of its prior.
LARGEST = 1e3


def list_law_joints(name: str, row: Float[NDArray[np.float64], " r"], basis: LawBasis, values: Vector) -> list[Joint]:
    """Joints with the force of a law along a row.

    Parameters
    ----------
    name
        Beginning of their names.
    row
        Row of the displacement, shape (r,) [-].
    basis, values
        Functions and their coefficients, shape (b,) [N].
    """
    ahead, back, damping = basis.pieces(values)
    stiffness, limit = basis.cells(values)
    least = LEAST * max(float(np.abs(values).max()), 1e-300) / basis.reach
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


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeLaw:
    """A law at a place as an effect, whose parameters are some of its coefficients.

    Parameters
    ----------
    name
        Name of the place.
    row
        Row of the displacement, shape (r,) [-].
    basis
        Functions of the law.
    size
        Size of each coefficient before any data, shape (b,) [N].
    active
        Mask of the coefficients that are fitted, shape (b,); the others are zero.
    """

    name: str
    row: Float[NDArray[np.float64], " r"]
    basis: LawBasis
    size: Vector
    active: NDArray[np.bool_]
    kind: str = "free law"
    physics: str = "A force that no known effect explains."
    signature: str = "What the recovered law says."

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """Active coefficients."""
        listed = []
        for number in np.flatnonzero(self.active).tolist():
            size, positive = float(self.size[number]), bool(self.basis.is_positive[number])
            listed.append(
                EffectParameter(
                    name=f"{GROUPS[self.basis.group[number]]} {number}", unit="N", typical=size,
                    lower=LEAST * size if positive else -LARGEST * size, upper=LARGEST * size,
                    vanishes=LEAST * size if positive else 0.0,
                )
            )  # fmt: skip
        return tuple(listed)

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Some joints more."""
        whole = np.zeros(len(self.size))
        whole[self.active] = values
        return model.with_system(
            joints=[*model.system.joints, *list_law_joints(f"law at {self.name}", self.row, self.basis, whole)]
        )
