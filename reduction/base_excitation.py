r"""Structure on a moving base: inertia load and absolute motion.

With the motion r of each degree of freedom for a unit motion of the base that the structure follows rigidly, the motion
of the structure is that of the base plus a relative motion q,

.. math:: u = r\, x_b + q, \qquad
          M \ddot q + C \dot q + K q + \ldots = -M r\, \ddot x_b, \qquad
          \ddot x_{b,k} = (i k \Omega)^p\, b_k

with amplitudes b_k of the acceleration (p = 0), the velocity (p = 1) or the displacement (p = 2) of the base. Springs,
dampers and contacts between structure and base depend on q only.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Complex, Float

from reduction.array_input import check_complex_array, check_finite_array, freeze_arrays, refuse_infinite
from reduction.array_type import Array, Matrix, Real, Row
from reduction.errors import JointError
from reduction.rom import ReducedModel

#: Quantity that is constant along a response curve, and power of Omega that converts it to an acceleration.
LEVEL_POWER = {"acceleration": 0, "velocity": 1, "displacement": 2}


@dataclass(frozen=True, kw_only=True, eq=False)
class BaseMotion:
    """Rigid motion of a structure with its base.

    Parameters
    ----------
    motion
        Motion r of each degree of freedom for a unit motion of the base, shape (r,) [-].
    inertia
        Inertia M r, including the mass of fixed degrees of freedom if it is known, shape (r,) [kg].
    """

    motion: Row
    inertia: Row

    def __post_init__(self) -> None:
        freeze_arrays(self, "motion", "inertia")

    @classmethod
    def of(cls, mass: Matrix, motion: Row) -> "BaseMotion":
        """Base motion of a structure from its mass, shape (r, r) [kg]."""
        n = np.shape(mass)[0]
        row = check_finite_array(
            motion, "the motion with the base", JointError, (n,), ", one number per degree of freedom"
        )
        return cls(motion=row, inertia=np.asarray(mass @ row))

    @classmethod
    def reduced(cls, rom: ReducedModel, motion: Float[Real, " n"], inertia: Float[Real, " n"]) -> "BaseMotion":
        """Base motion of a reduced model.

        The motion of boundary degrees of freedom is given; that of modal coordinates follows from the inertia.

        Parameters
        ----------
        rom
            Reduced model.
        motion, inertia
            Motion r and inertia M r of the rows of `rom.recovery`, shape (n,) [-, kg].
        """
        place = np.searchsorted(rom.free, 3 * rom.boundary_node + rom.boundary_direction)
        b, load = rom.n_boundary, rom.recovery.T @ inertia
        row = np.zeros(rom.n_dof)
        row[:b] = motion[place]
        if rom.n_dof > b:
            row[b:] = np.linalg.solve(rom.mass[b:, b:], load[b:] - rom.mass[b:, :b] @ row[:b])
        return cls(motion=row, inertia=load)


@dataclass(frozen=True, kw_only=True, eq=False)
class BaseExcitation:
    """Periodic excitation by the base.

    Parameters
    ----------
    base
        Rigid motion of the structure with the base.
    amplitude
        Amplitudes b_k: a number for harmonic 1, or coefficients of e^{i k Omega t}, shape (n_harmonic,), with a zero
        mean as first entry [m/s^2, m/s or m].
    quantity
        Quantity of the amplitude: "acceleration", "velocity" or "displacement".

    Raises
    ------
    JointError
        Another quantity, an amplitude that is not finite, or a mean that is not zero.
    """

    base: BaseMotion
    amplitude: complex | Complex[Array, " harmonic"]
    quantity: str = "acceleration"
    _coefficients: Complex[Array, " harmonic"] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.quantity not in LEVEL_POWER:
            raise JointError(f'quantity = "{self.quantity}": give {", ".join(LEVEL_POWER)}')
        given = check_complex_array(self.amplitude, "the amplitude of the base", JointError)
        coefficients = np.array([0.0, given]) if given.ndim == 0 else given
        refuse_infinite(coefficients, "the amplitude of the base", JointError)
        if coefficients.ndim != 1 or not len(coefficients) or coefficients[0]:
            raise JointError(
                f"the amplitude of the base has shape {given.shape}: give a number, or one for each harmonic, the "
                "first of them 0, since a constant motion has no effect"
            )
        object.__setattr__(self, "_coefficients", coefficients)

    @property
    def level_power(self) -> int:
        """Power p: the level of `force` is multiplied by Omega^p."""
        return LEVEL_POWER[self.quantity]

    @property
    def acceleration(self) -> Complex[Array, "harmonic r"]:
        """Acceleration of each degree of freedom with the base, at level 1, shape (n_harmonic, r) [m/s^2 / Omega^p]."""
        return np.outer(self._unit, self.base.motion)

    @property
    def force(self) -> Complex[Array, "harmonic r"]:
        """Inertia load at level 1, shape (n_harmonic, r) [N / Omega^p]."""
        return -np.outer(self._unit, self.base.inertia)

    @property
    def _unit(self) -> Complex[Array, " harmonic"]:
        return np.asarray((1j * np.arange(len(self._coefficients))) ** self.level_power * self._coefficients)

    def absolute(
        self,
        coefficients: Complex[Array, "*p harmonic r"],
        angular_frequency: Float[Real, " *p"] | float,
        level: Float[Real, " *p"] | float,
    ) -> Complex[Array, "*p harmonic r"]:
        """Absolute motion from the motion relative to the base.

        Parameters
        ----------
        coefficients
            Coefficients of a state, shape (n_harmonic, r), or of the p points of a curve, shape (p, n_harmonic, r) [m].
        angular_frequency, level
            Angular frequency and level of the state or of each point; the level includes Omega^p [rad/s, -].
        """
        result = np.array(coefficients, dtype=np.complex128)
        carried = self.acceleration
        omega, scale = np.asarray(angular_frequency)[..., None], np.asarray(level)[..., None]
        for k in range(1, min(len(carried), result.shape[-2])):
            result[..., k, :] += scale * carried[k] / (1j * k * omega) ** 2
        return result
