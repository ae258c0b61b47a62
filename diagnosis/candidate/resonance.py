"""First resonance that the force excites, with all contacts stuck: basis of the typical strengths of effects."""

from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, eigh

from diagnosis.candidate.effect import EffectError
from reduction.jointed_system import JointedSystem, modal_damping
from reduction.stuck import stuck_stiffness

Row = Float[NDArray[np.float64], " r"]
Rows = Float[NDArray[np.float64], "t r"]
Matrix = Float[NDArray[np.float64], "r r"]

#: Relative shift of the resonance by a typical spring or mass; relative increase of damping by a typical damper [-].
SHIFT, DAMPING_SHARE = 0.005, 0.1
#: Least damping ratio that is used.
LEAST_DAMPING_RATIO = 1e-3
#: Least modal force of an excited mode over the largest one; eigenvalues below this share of the largest are round-off.
DRIVEN, ROUNDING = 1e-3, 1e-13


@dataclass(frozen=True, kw_only=True, eq=False)
class ResonanceModel:
    """Modes of one configuration with all contacts stuck, and its response to the force.

    Parameters
    ----------
    system
        Structure, with contacts or without.
    angular_frequencies, mode_shapes
        All modes, mass-normalised, shapes (r,) and (r, r) [rad/s, 1/sqrt(kg)].
    number
        Index of the first mode that the force excites.
    level
        Level of the force [N].
    """

    system: JointedSystem
    angular_frequencies: Row
    mode_shapes: Matrix
    number: int
    level: float

    @property
    def angular_frequency(self) -> float:
        """Angular frequency of the mode [rad/s]."""
        return float(self.angular_frequencies[self.number])

    @property
    def mode_shape(self) -> Row:
        """Mass-normalised shape of the mode, shape (r,) [1/sqrt(kg)]."""
        return self.mode_shapes[:, self.number]

    @cached_property
    def modal_damping(self) -> float:
        """Damping of the mode at unit modal mass, 2 zeta omega [1/s]."""
        least = 2 * LEAST_DAMPING_RATIO * self.angular_frequency
        own = modal_damping(self.system, self.mode_shape[:, None], np.array([self.angular_frequency]))
        return max(float(own[0]), least)

    @cached_property
    def modal_amplitude(self) -> float:
        """Amplitude of the mode at its resonance, while all contacts stick [m sqrt(kg)]."""
        force = float(np.abs(self.system.dynamic @ self.mode_shape).max())
        return self.level * force / (self.angular_frequency * self.modal_damping)

    def motion(self, row: Row) -> float:
        """Motion of a displacement in the mode [1/sqrt(kg)]."""
        return abs(float(row @ self.mode_shape))

    def amplitude(self, row: Row) -> float:
        """Amplitude of a displacement at the resonance [m]."""
        return self.motion(row) * self.modal_amplitude

    def modal_mass(self, row: Row) -> float:
        """Modal mass referred to a displacement [kg]; infinite if it does not move."""
        motion = self.motion(row)
        return motion**-2 if motion else np.inf

    def receptance(self, rows: Rows, angular_frequency: float) -> Float[NDArray[np.float64], "t t"]:
        """Undamped receptance between displacements, shape (t, t) [m/N]."""
        modal = rows @ self.mode_shapes
        return np.asarray((modal / (self.angular_frequencies**2 - angular_frequency**2)) @ modal.T)

    def stiffening(self, row: Row) -> float | None:
        """Stiffness k that raises the resonance by `SHIFT`, where 1 + k G = 0 [N/m]; None if no spring can."""
        receptance = float(self.receptance(row[None], (1 + SHIFT) * self.angular_frequency)[0, 0])
        return -1 / receptance if receptance < 0 else None

    def softening(self, row: Row) -> float | None:
        """Stiffness k < 0 that lowers the resonance by `SHIFT`, where 1 + k G = 0 [N/m]; None if no spring can."""
        receptance = float(self.receptance(row[None], (1 - SHIFT) * self.angular_frequency)[0, 0])
        return -1 / receptance if receptance > 0 else None

    def point_mass(self, rows: Rows) -> float | None:
        """Mass m that lowers the resonance by `SHIFT`, where 1 = omega^2 m G [kg]; None if no mass can."""
        shifted = (1 - SHIFT) * self.angular_frequency
        receptance = float(np.linalg.eigvalsh(self.receptance(rows, shifted))[-1])
        return 1 / (shifted**2 * receptance) if receptance > 0 else None

    def dashpot(self, row: Row) -> float:
        """Damping that adds `DAMPING_SHARE` of the modal damping [N s/m]."""
        return DAMPING_SHARE * self.modal_damping * self.modal_mass(row)

    def drag(self, row: Row) -> float | None:
        """Quadratic damping d equivalent to `dashpot` at resonance, 8/(3 pi) d omega a [N s^2/m^2]; None if a = 0."""
        speed = self.angular_frequency * self.amplitude(row)
        return 3 * pi / 8 * self.dashpot(row) / speed if speed else None

    def cubic(self, row: Row, spring: float) -> float | None:
        """Cubic stiffness k equivalent to a spring at resonance, 3/4 k a^2 [N/m^3]; None if the amplitude a is 0."""
        amplitude = self.amplitude(row)
        return 4 / 3 * abs(spring) / amplitude**2 if amplitude else None


def find_resonance(system: JointedSystem, level: float) -> ResonanceModel | None:
    """Resonance of a system at a level [N]; None for a structure that is not supported."""
    try:
        squared, mode_shapes = eigh(stuck_stiffness(system.stiffness, system.joints), system.mass)
    except LinAlgError as error:
        raise EffectError("the mass matrix is not positive definite: give that of a vibrating structure") from error
    if not squared[0] > ROUNDING * squared[-1]:
        return None
    driven = np.abs(system.dynamic @ mode_shapes).max(axis=0)
    return ResonanceModel(
        system=system,
        angular_frequencies=np.sqrt(squared),
        mode_shapes=mode_shapes,
        number=int(np.argmax(driven >= DRIVEN * driven.max())),
        level=level,
    )
