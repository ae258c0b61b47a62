r"""A path over Omega along which the amplitude of a sensor is held and the level of the force is unknown.

The sensor reads :math:`y = D \lambda - C^T g_1` in the first harmonic: D under the force at level 1, C under unit joint
forces. With the reading held at a real y, the complex level of the force and the motion of the joint directions are

.. math:: \lambda = \frac{y + C^T g_1}{D}, \qquad
          x_1 = \frac{d}{D}\, y - \left(A_1 - \frac{d\, C^T}{D}\right) g_1

where d is the displacement of the directions under the force at level 1. All other harmonics are unchanged. This is the
balance of the joint directions with another linear motion and another receptance, so that Newton's method and the arc
are those of any branch. A shift of time by the phase of lambda converts its states into states under the given force.

References
----------
Karaagacli and Ozguven, Experimental modal analysis of nonlinear systems by using response-controlled stepped-sine
testing, Mech. Syst. Signal Process. 146 (2021), 107023.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex

from hbsolve.aft import JointForces
from hbsolve.balance import HarmonicBalance, check_frequency
from hbsolve.condensed import Condensed, CondensedSlopes, CondensedStructure
from hbsolve.continuation.continuation_parameter import Path
from hbsolve.errors import BalanceError
from hbsolve.newton import apply_receptance
from hbsolve.sampling import complex_from_real, real_from_complex
from hbsolve.state import SteadyState, harmonic_at
from reduction.array_input import check_finite_number, check_whole_number
from reduction.array_type import Array, Real, Vector
from reduction.base_excitation import BaseExcitation

#: Reading under the force, relative to the displacement of the structure, up to which it is round-off.
UNMOVED = 1e-10


class Reading(NamedTuple):
    """Reading of a sensor in harmonic 1 at one Omega, as a displacement."""

    driven: complex
    """D, the reading under the force at level 1 [m]."""
    receptance: Complex[Array, " d"]
    """C, the reading under a unit force along each joint direction, shape (d,) [m/N]."""

    def level(self, held: float, g: Real) -> complex:
        """Level of the force that holds the reading with the joint forces g, shape (d, nh) [-]."""
        return complex((held + self.receptance @ complex_from_real(g)[1]) / self.driven)


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlledAmplitude(Path):
    """Lambda is Omega [rad/s]; the motion has the phase in which the reading is real.

    Parameters
    ----------
    balance
        Balance whose force acts in harmonic 1 alone; its level is not used.
    row
        Sensor, a degree of freedom or a row over all of them, shape (r,) [-].
    amplitude
        Amplitude of the first harmonic of its reading [m, m/s or m/s^2].
    derivative
        Whether it reads the displacement (0), the velocity (1) or the acceleration (2).
    base
        Motion of the base that excites the system, if the sensor reads the absolute motion; by default the sensor reads
        the motion relative to the base, or the base does not move.

    Raises
    ------
    BalanceError
        A row of another size, of zeros, or that the force does not move; an amplitude that is not positive; another
        derivative; a force in another harmonic than the first, or no force; a base motion with another force.
    """

    row: int | Vector
    amplitude: float
    derivative: int = 0
    base: BaseExcitation | None = None
    unit = "Hz"

    def __post_init__(self) -> None:
        amplitude = check_finite_number(self.amplitude, "amplitude", BalanceError)
        if amplitude <= 0:
            raise BalanceError(
                f"amplitude = {amplitude:g} must be positive: it is the amplitude that the control maintains"
            )
        object.__setattr__(self, "amplitude", amplitude)
        object.__setattr__(self, "row", _make_sensor_row(self.row, self.balance.system.n_dof))
        if check_whole_number(self.derivative, "derivative", BalanceError) not in (0, 1, 2):
            raise BalanceError(
                f"derivative = {self.derivative} must be 0, 1 or 2: displacement, velocity or acceleration"
            )
        driven = [int(k) for k in np.flatnonzero(self.balance.structure.dynamic.any(axis=1))]
        if driven != [1]:
            where = f"in the harmonics {', '.join(map(str, driven))}" if driven else "nowhere"
            raise BalanceError(
                f"the harmonic force acts {where}: response control scales only a force in harmonic 1, so give "
                "such a force"
            )
        if self.base is not None and not _is_force(self.base, self.balance.structure.dynamic):
            raise BalanceError(
                "the balance is not excited by the base: give the system `base.force` and no other force"
            )

    def displayed(self, value: float) -> float:
        """Omega in Hz."""
        return value / (2 * np.pi)

    def held(self, value: float) -> float:
        """Amplitude to be held at Omega, as a displacement [m]."""
        return float(self.amplitude / value**self.derivative)

    def at(self, value: float) -> tuple[HarmonicBalance, Condensed]:
        """See `Path`; the linear structure is that of the held reading.

        Only the motion of the joint directions is correct in its states: `ordinary` gives the reading, from which the
        level of the force follows, and the structure under the given force.
        """
        seen = self._structure.at_with_slopes(check_frequency(value))
        assert seen.slopes is not None
        reading, own = self._split(seen)
        if reading.driven == 0:
            raise BalanceError(self._unmoved(value))
        slope, by_own = self._split(seen._replace(columns=seen.slopes.columns, dynamic=seen.slopes.dynamic))
        # The displacement of the base falls with the square of Omega, which is not in the slope of the structure.
        by_driven = slope.driven - (1 + 2 / value) * self._carried(value)
        y = self.held(value)
        share = own.dynamic[1] / reading.driven
        by_share = (by_own.dynamic[1] - share * by_driven) / reading.driven
        dynamic, by_dynamic = np.zeros_like(own.dynamic), np.zeros_like(own.dynamic)
        dynamic[1] = y * share
        by_dynamic[1] = y * (by_share - share * self.derivative / value)
        A, by_A = own.columns.copy(), by_own.columns.copy()
        A[1] -= np.outer(reading.receptance, share)
        by_A[1] -= np.outer(reading.receptance, by_share) + np.outer(slope.receptance, share)
        held = own._replace(columns=A, dynamic=dynamic, slopes=CondensedSlopes(by_A, by_dynamic))
        return self._unit_balance, held

    def reading_of(self, state: SteadyState) -> complex:
        """Complex amplitude of the reading in a state [m, m/s or m/s^2]."""
        omega = state.angular_frequency
        moved = state.coefficients[1] @ self.row + state.level * self._carried(omega)
        return complex((1j * omega) ** self.derivative * moved)

    def ordinary(self, value: float) -> tuple[Reading, Condensed]:
        """The reading, and the linear structure under the given force."""
        return self._split(self._structure.at(value))

    def by_value(self, balance: HarmonicBalance, condensed: Condensed, forces: JointForces) -> Real:
        """See `Path`."""
        del balance
        slopes = condensed.slopes
        assert slopes is not None
        moved = apply_receptance(slopes.columns, forces.coefficients) - real_from_complex(slopes.dynamic)
        return np.asarray(moved + apply_receptance(condensed.columns, forces.by_frequency))

    def refuse_unmoved(self, value: float) -> None:
        """Refuse a sensor that the force does not move at Omega (`BalanceError`)."""
        reading, condensed = self.ordinary(value)
        structure = self.balance.structure
        moved = float(np.linalg.norm(structure.displacement(condensed, structure.dynamic)[1]))
        if not abs(reading.driven) > UNMOVED * float(np.linalg.norm(self.row)) * moved:
            raise BalanceError(self._unmoved(value))

    def _unmoved(self, value: float) -> str:
        return (
            f"the force does not move the sensor at {self.displayed(value):.6g} Hz, so no level can control its "
            "amplitude: give another sensor, or another force"
        )

    def _split(self, condensed: Condensed) -> tuple[Reading, Condensed]:
        """The last row as a reading, and the directions before it."""
        A, x = condensed.columns, condensed.dynamic
        driven = complex(x[1, -1] + self._carried(condensed.angular_frequency))
        own = Condensed(
            condensed.angular_frequency,
            np.ascontiguousarray(A[:, :-1, :-1]),
            np.ascontiguousarray(condensed.static[:, :-1]),
            np.ascontiguousarray(x[:, :-1]),
        )
        return Reading(driven, np.ascontiguousarray(A[1, :-1, -1])), own

    def _carried(self, value: float) -> complex:
        """Displacement of the base in the reading, at level 1 [m]."""
        return self._base_acceleration / (1j * value) ** 2

    @cached_property
    def _base_acceleration(self) -> complex:
        return 0j if self.base is None else complex(self.base.acceleration[1] @ self.row)

    @cached_property
    def _structure(self) -> CondensedStructure:
        return self.balance.structure.with_rows(np.asarray(self.row)[None])

    @cached_property
    def _unit_balance(self) -> HarmonicBalance:
        return self.balance.at_level(1.0)


def _make_sensor_row(row: int | Vector, n_dof: int) -> Real:
    """Row over all degrees of freedom of a sensor that is given as a row or as one degree of freedom."""
    weights = harmonic_at(np.eye(n_dof, dtype=np.complex128)[:, None], row, 0).real
    if not weights.any():
        raise BalanceError("the row is zero, so there is no amplitude to control: give a nonzero row")
    return np.asarray(weights)


def _is_force(base: BaseExcitation, dynamic: Array) -> bool:
    """Whether the force of a balance, which acts in harmonic 1 alone, is that of a moving base."""
    force = base.force
    fits = len(force) > 1 and force.shape[1] == dynamic.shape[1] and not force[2:].any()
    return fits and np.allclose(force[1], dynamic[1], rtol=1e-9, atol=0.0)
