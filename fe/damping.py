"""Rayleigh damping, C = alpha M + beta K."""

from dataclasses import dataclass, replace
from math import pi

import scipy.sparse as sp

from fe.system import LinearSystem
from geometry.errors import InputError


@dataclass(frozen=True, kw_only=True)
class RayleighDamping:
    """Damping proportional to mass and stiffness.

    Parameters
    ----------
    mass_factor
        Coefficient alpha of the mass [1/s].
    stiffness_factor
        Coefficient beta of the stiffness [s].
    """

    mass_factor: float
    stiffness_factor: float

    def damping_ratio(self, angular_frequency: float) -> float:
        """Damping ratio alpha / (2 omega) + beta omega / 2 [-], at an angular frequency [rad/s]."""
        return self.mass_factor / (2 * angular_frequency) + self.stiffness_factor * angular_frequency / 2


def rayleigh_damping(damping_ratio: float, frequency: float) -> RayleighDamping:
    """Rayleigh damping with a given ratio of one mode, half of it from mass and half from stiffness.

    With alpha = zeta omega and beta = zeta / omega, zeta(omega) has its minimum at the mode: other modes are damped at
    least as much, and a small error of the frequency does not change the ratio.

    Parameters
    ----------
    damping_ratio
        Damping ratio zeta [-], in [0, 1).
    frequency
        Frequency of the mode [Hz], positive.

    Raises
    ------
    InputError
        A value outside its range.
    """
    if not 0 <= damping_ratio < 1:
        raise InputError(f"damping_ratio = {damping_ratio:g} must lie in [0, 1): 0.002 is 0.2 %")
    if not frequency > 0:
        raise InputError(f"frequency = {frequency:g} Hz must be positive: give that of the damped mode")
    angular_frequency = 2 * pi * frequency
    return RayleighDamping(
        mass_factor=damping_ratio * angular_frequency, stiffness_factor=damping_ratio / angular_frequency
    )


def add_damping(system: LinearSystem, damping: RayleighDamping) -> LinearSystem:
    """System with its damping matrix replaced by alpha M + beta K; grounded springs are part of K."""
    C = damping.mass_factor * system.mass.tocsr() + damping.stiffness_factor * system.stiffness.tocsr()
    return replace(system, damping=sp.csr_array(C))
