r"""Objectives of limits: a harmonic of an output, or a static or dynamic contact force.

All of these are linear in the motion x of the joint directions and in the joint forces g = f - D x,

.. math:: z = c + p \cdot x_k + s_k \cdot g_k ,

and the objective is the amplitude abs(z), or z itself for a mean. For an output row o, c is its stuck response to the
loads and s = -o alpha(k Omega) B^T; for the force of joints, f = g + D x.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float

from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.errors import BalanceError
from hbsolve.joint_law.registry import FORCE
from hbsolve.limits.sliders import make_slider_table
from hbsolve.solution import forces_at
from hbsolve.state import check_harmonic, make_initial_sliders
from reduction.array_input import check_finite_array
from reduction.array_type import Array, Real, Whole

#: Least reference for relative gains of a force or a mean, relative to its size by friction and loads at rest.
MIN_RELATIVE_SIZE = 0.01


class Measure(Protocol):
    """A number of one motion, and its derivatives; x and g have shape (d, nh)."""

    @property
    def least(self) -> float:
        """Least reference for relative gains."""
        ...

    def value(self, level: float, x: Real, g: Real) -> float:
        """Value of the number."""
        ...

    def slopes(self, level: float, x: Real, g: Real) -> tuple[Real, Real]:
        """Derivatives with respect to x and g, shape (d, nh) both."""
        ...


class Objective(Protocol):
    """Quantity whose limits are sought."""

    def check(self, balance: HarmonicBalance) -> None:
        """Refuse (`BalanceError`) an objective that the system does not have."""
        ...

    def measure(self, balance: HarmonicBalance, condensed: Condensed) -> Measure:
        """Measure of the objective at one frequency."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearMeasure:
    """Amplitude of harmonic k of z above, or its mean for k = 0."""

    harmonic: int
    static: complex
    """Part of c at rest; the other part is `dynamic` times the level."""
    dynamic: complex
    by_motion: Array
    """p, shape (d,)."""
    by_force: Array
    """s, shape (d,)."""
    least: float

    def _complex(self, level: float, x: Real, g: Real) -> complex:
        k = self.harmonic
        parts = [item[:, 0] if k == 0 else item[:, 2 * k - 1] - 1j * item[:, 2 * k] for item in (x, g)]
        return complex(self.static + level * self.dynamic + self.by_motion @ parts[0] + self.by_force @ parts[1])

    def value(self, level: float, x: Real, g: Real) -> float:
        """See `Measure`."""
        z = self._complex(level, x, g)
        return z.real if self.harmonic == 0 else abs(z)

    def slopes(self, level: float, x: Real, g: Real) -> tuple[Real, Real]:
        """See `Measure`."""
        z = self._complex(level, x, g)
        result = []
        for factor in (self.by_motion, self.by_force):
            slope = np.zeros_like(x)
            if self.harmonic == 0:
                slope[:, 0] = factor.real
            else:
                # d|z| = Re(conj(z) dz) / |z|, dz = factor (dx_c - i dx_s)
                turned = np.conj(z) * factor / max(abs(z), np.finfo(float).tiny)
                slope[:, 2 * self.harmonic - 1], slope[:, 2 * self.harmonic] = turned.real, turned.imag
            result.append(slope)
        return result[0], result[1]


@dataclass(frozen=True, kw_only=True, eq=False)
class OutputHarmonic:
    """Amplitude of one harmonic of a displacement, or its mean [m].

    Parameters
    ----------
    row
        A degree of freedom, or weights over all of them, shape (r,).
    harmonic
        Harmonic k, the fundamental by default; 0 for the mean [-].
    base
        Acceleration of a moving base in this harmonic at level 1 [m/s^2], whose motion is added to the relative motion
        of the output; 0 by default, which bounds the relative motion.
    """

    row: int | Float[Real, " r"]
    harmonic: int = 1
    base: complex = 0.0

    def check(self, balance: HarmonicBalance) -> None:
        """See `Objective`.

        Raises
        ------
        BalanceError
            A degree of freedom or a harmonic that the balance does not have, or a row of another size.
        """
        self._weights(balance)
        check_harmonic(self.harmonic, balance.n_harmonic)

    def _weights(self, balance: HarmonicBalance) -> Real:
        r = balance.system.n_dof
        if isinstance(self.row, int | np.integer):
            if not 0 <= self.row < r:
                raise BalanceError(f"degree of freedom {self.row} does not exist: the system has 0 to {r - 1}")
            return np.asarray(np.eye(r)[self.row])
        return check_finite_array(self.row, "the output row", BalanceError, (r,), ", over all degrees of freedom")

    def measure(self, balance: HarmonicBalance, condensed: Condensed) -> LinearMeasure:
        """See `Objective`."""
        row, recovery = self._weights(balance), balance.structure.recovery(condensed)
        by_force = -(row @ recovery.contact[self.harmonic]).astype(np.complex128)
        # Gains are relative to an amplitude; a mean may be zero, and is compared with its range by friction.
        moved = np.abs(by_force) @ np.abs(_compute_rest_forces(balance, condensed)) if self.harmonic == 0 else 0.0
        carried = self.base / (self.harmonic * condensed.angular_frequency) ** 2 if self.harmonic else 0.0
        return LinearMeasure(
            harmonic=self.harmonic,
            static=complex(recovery.static[self.harmonic] @ row),
            dynamic=complex(recovery.dynamic[self.harmonic] @ row) - carried,
            by_motion=np.zeros(balance.n_direction, dtype=np.complex128),
            by_force=by_force,
            least=max(MIN_RELATIVE_SIZE * float(moved), float(np.finfo(float).tiny)),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactForceHarmonic:
    """The mean or the amplitude of a contact force, of one contact or summed over several, such as a line [N].

    Parameters
    ----------
    joints
        Names of the contacts.
    direction
        Number of the tangent from 0 on, or -1 for the normal force.
    harmonic
        0 for the static force, 1 for the amplitude of its fundamental [-].
    """

    joints: Sequence[str]
    direction: int
    harmonic: int = 0

    def check(self, balance: HarmonicBalance) -> None:
        """See `Objective`.

        Raises
        ------
        BalanceError
            A contact, direction or harmonic that the balance does not have.
        """
        self._directions(balance)
        check_harmonic(self.harmonic, balance.n_harmonic)

    def _directions(self, balance: HarmonicBalance) -> Whole:
        if isinstance(self.joints, str) or not len(self.joints):
            raise BalanceError(f"joints = {self.joints!r}: give a list with the names of contacts")
        names = [joint.name for joint in balance.system.joints]
        result = []
        for name in self.joints:
            if name not in names or balance.system.joints[names.index(name)].normal_direction is None:
                raise BalanceError(f'"{name}" is not a friction contact of the system: give the name of one')
            first, last = balance.table.direction[names.index(name) :][:2]
            if not -1 <= self.direction < last - first - 1:
                raise BalanceError(
                    f'contact "{name}" has no direction {self.direction}: give -1 for the normal, or a tangent from 0'
                )
            result.append(last - 1 if self.direction == -1 else first + self.direction)
        return np.array(result, dtype=np.int64)

    def measure(self, balance: HarmonicBalance, condensed: Condensed) -> LinearMeasure:
        """See `Objective`."""
        at = self._directions(balance)
        load = np.abs(_compute_rest_forces(balance, condensed)).mean() * len(at)
        by_motion, by_force = np.zeros((2, balance.n_direction), dtype=np.complex128)
        by_motion[at], by_force[at] = balance.table.reference[at], 1.0
        return LinearMeasure(
            harmonic=self.harmonic,
            static=0.0,
            dynamic=0.0,
            by_motion=by_motion,
            by_force=by_force,
            least=float(MIN_RELATIVE_SIZE * load) or 1.0,
        )


def _compute_rest_forces(balance: HarmonicBalance, condensed: Condensed) -> Real:
    """Size of the force of each direction at rest, and for tangents their friction limit, shape (d,) [N]."""
    table, start = make_slider_table(balance), make_initial_sliders(balance, None)
    rest = balance.linear(condensed, 0.0)
    forces = forces_at(balance, condensed.angular_frequency, rest, start, FORCE)
    result = np.abs(forces.coefficients[:, 0] + balance.table.reference * rest[:, 0])
    limit = table.constant + np.where(table.normal >= 0, table.by_normal * rest[table.normal, 0], 0.0)
    result[table.tangent] = np.maximum(limit, 0.0)
    return np.asarray(result)
