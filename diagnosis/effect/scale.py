"""How strong an effect must be to matter: measured on the first stuck mode, so that it suits a model of any size.

While all contacts stick, the structure is linear: its first mode that the force drives tells how far a place moves at
resonance, how much damping there is, and what a spring or a mass must be to shift the resonance.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh

from correlation.test_model import TestModel
from diagnosis.effect.candidate import EffectError
from reduction.jointed_system import FrictionContact, JenkinsElement, JointedSystem

Row = Float[NDArray[np.float64], " r"]
Rows = Float[NDArray[np.float64], "t r"]
Matrix = Float[NDArray[np.float64], "r r"]

#: A typical spring or mass shifts the resonance by this share of itself; a typical damper adds this share of damping.
SHIFT, DAMPING_SHARE = 0.005, 0.1
#: Damping ratio to reckon with where the structure has less.
LEAST_DAMPING_RATIO = 1e-3
#: A mode is driven if its modal force is this share of the largest; eigenvalues below this share are rounding.
DRIVEN, ROUNDING = 1e-3, 1e-13
#: Share of what would make the structure unstable, or massless, that a bound leaves to a negative spring or mass.
REMOVABLE = 0.9


@dataclass(frozen=True, kw_only=True, eq=False)
class Scale:
    """Modes of a test model with all contacts stuck, and its response there.

    Parameters
    ----------
    system
        The structure.
    angular_frequencies, mode_shapes
        Of all stuck modes, mass-normalised, shapes (r,) and (r, r) [rad/s, 1/sqrt(kg)].
    number
        Of the first mode that the force drives.
    level
        Of the force [N].
    """

    system: JointedSystem
    angular_frequencies: Row
    mode_shapes: Matrix
    number: int
    level: float

    @property
    def angular_frequency(self) -> float:
        """Of the mode [rad/s]."""
        return float(self.angular_frequencies[self.number])

    @property
    def mode_shape(self) -> Row:
        """Mass-normalised, shape (r,) [1/sqrt(kg)]."""
        return self.mode_shapes[:, self.number]

    @cached_property
    def modal_damping(self) -> float:
        """Of the mode at unit modal mass, 2 zeta omega [1/s]."""
        least = 2 * LEAST_DAMPING_RATIO * self.angular_frequency
        return max(float(self.mode_shape @ self.system.damping @ self.mode_shape), least)

    @cached_property
    def modal_amplitude(self) -> float:
        """Of the mode at its resonance, while all contacts stick [m sqrt(kg)]."""
        force = float(np.abs(self.system.dynamic @ self.mode_shape).max())
        return self.level * force / (self.angular_frequency * self.modal_damping)

    def amplitude(self, row: Row) -> float:
        """Of a displacement at the resonance [m]."""
        return abs(float(row @ self.mode_shape)) * self.modal_amplitude

    def modal_mass(self, row: Row) -> float:
        """Mass of the mode as seen at a displacement [kg]."""
        return float(row @ self.mode_shape) ** -2

    def modal_stiffness(self, row: Row) -> float:
        """Stiffness of the mode as seen at a displacement [N/m]."""
        return self.angular_frequency**2 * self.modal_mass(row)

    def receptance(self, rows: Rows, angular_frequency: float) -> Float[NDArray[np.float64], "t t"]:
        """Undamped stuck receptance between displacements, shape (t, t) [m/N]."""
        modal = rows @ self.mode_shapes
        return np.asarray((modal / (self.angular_frequencies**2 - angular_frequency**2)) @ modal.T)

    def spring(self, row: Row) -> float | None:
        """Stiffness k that shifts the resonance by `SHIFT`: 1 + k G = 0 at the shifted frequency [N/m].

        Negative where no spring is stiff enough to shift it, since the place hardly moves, but less stiffness does;
        none where neither can.
        """
        stiffer = float(self.receptance(row[None], (1 + SHIFT) * self.angular_frequency)[0, 0])
        if stiffer < 0:
            return -1 / stiffer
        softer = -1 / float(self.receptance(row[None], (1 - SHIFT) * self.angular_frequency)[0, 0])
        return softer if 0 > softer > -self.removable_stiffness(row) else None

    def point_mass(self, rows: Rows) -> float | None:
        """Mass m that lowers the resonance by `SHIFT`: 1 = omega^2 m G at the shifted frequency [kg]; none if none."""
        shifted = (1 - SHIFT) * self.angular_frequency
        receptance = float(np.linalg.eigvalsh(self.receptance(rows, shifted))[-1])
        return 1 / (shifted**2 * receptance) if receptance > 0 else None

    def dashpot(self, row: Row) -> float:
        """Damping that adds `DAMPING_SHARE` of the modal damping [N s/m]."""
        return DAMPING_SHARE * self.modal_damping * self.modal_mass(row)

    def removable_stiffness(self, row: Row) -> float:
        """Stiffness that can be taken away with the structure still held without its contacts [N/m]; 0 if it is not."""
        try:
            compliance = float(row @ cho_solve(cho_factor(self.system.stiffness), row))
        except LinAlgError:
            return 0.0
        return REMOVABLE / compliance

    def removable_mass(self, rows: Rows) -> float:
        """Mass that can be taken away with the mass matrix still positive definite [kg]."""
        inverse = rows @ cho_solve(cho_factor(self.system.mass), rows.T)
        return REMOVABLE / float(np.linalg.eigvalsh(inverse)[-1])


def scale(test_model: TestModel, level: float = 1.0) -> Scale:
    """Stuck modes and the response at a level.

    Parameters
    ----------
    test_model
        With its joints and loads.
    level
        Of the force, best the highest of the tests [N].

    Raises
    ------
    EffectError
        A structure that is not held even with all contacts stuck, a mass that is not positive definite, or a level
        that is not positive.
    """
    if not (np.isfinite(level) and level > 0):
        raise EffectError(f"level = {level:g} N must be positive: give the highest force level of the tests")
    system = test_model.system
    try:
        squared, mode_shapes = eigh(stuck_stiffness(system), system.mass)
    except LinAlgError as error:
        raise EffectError("the mass matrix is not positive definite: give that of a vibrating structure") from error
    if not squared[0] > ROUNDING * squared[-1]:
        raise EffectError(
            f"the lowest squared angular frequency with all contacts stuck is {squared[0]:.3g} 1/s^2: "
            "hold the structure by a support or a contact"
        )
    driven = np.abs(system.dynamic @ mode_shapes).max(axis=0)
    return Scale(
        system=system,
        angular_frequencies=np.sqrt(squared),
        mode_shapes=mode_shapes,
        number=int(np.argmax(driven >= DRIVEN * driven.max())),
        level=level,
    )


def stuck_stiffness(system: JointedSystem) -> Matrix:
    """Stiffness with all contacts closed and stuck, shape (r, r) [N/m]."""
    total = np.array(system.stiffness)
    for joint in system.joints:
        if isinstance(joint, FrictionContact):
            total += joint.tangential_stiffness * joint.tangents.T @ joint.tangents
            total += joint.normal_stiffness * np.outer(joint.normal, joint.normal)
        elif isinstance(joint, JenkinsElement):
            total += joint.tangential_stiffness * np.outer(joint.direction, joint.direction)
    return total
