"""Base class of contacts: a unilateral normal spring with a preload or a gap."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.elastic_energy import compute_spring_energy_about_mean
from reduction.joint_law.registry import Joint, Plausible

#: Plausible friction coefficients: clean metals in vacuum and soft rubber reach a few units (Bowden and Tabor, 1950).
#: With larger coefficients contacts wedge: response curves fold thousands of times, or there is no steady state.
PLAUSIBLE_FRICTION = Plausible(
    10.0,
    "is beyond that of any two solids (0 to 10): divide it by 100 if it is in percent, or use a spring instead of a "
    "contact that never slips",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class PressedJoint(Joint):
    """N = max(N_0 + k_n (v - g), 0) along the last direction; v > 0 closes the contact.

    Parameters
    ----------
    name
        Name in messages and results.
    normal
        Row of v, shape (r,) [-].
    normal_stiffness
        Normal stiffness k_n [N/m].
    preload
        Preload N_0, the normal force at v = g; a negative value holds the contact open [N].
    gap
        Gap g; negative for an interference [m].
    """

    name: str
    normal: Row
    normal_stiffness: float
    preload: float = 0.0
    gap: float = 0.0

    @property
    def force_at_rest(self) -> float:
        """Normal force N at v = 0; zero if the contact is open [N]."""
        return max(self.preload - self.normal_stiffness * self.gap, 0.0)

    @property
    def stuck_force(self) -> tuple[float, ...]:
        """Force N_0 - k_n g in the normal direction [N]."""
        return (0.0,) * self.normal_direction + (self.preload - self.normal_stiffness * self.gap,)

    @property
    def normal_direction(self) -> int:
        """Number of the last direction."""
        return len(self.directions) - 1

    def normal_energy(self, parameters: Mapping[str, float], displacement: Row) -> Row:
        """Energy N^2 / (2 k_n) about the mean of v, shape (n,) [J]; arguments as in `spring_energy`, normal only."""
        stiffness, preload, gap = (parameters[name] for name in ("normal_stiffness", "preload", "gap"))

        def force(v: Row) -> Row:
            return np.maximum(preload + stiffness * (v - gap), 0.0)

        return compute_spring_energy_about_mean(lambda v: force(v) ** 2 / (2 * stiffness), force, displacement)

    @property
    def open_at_rest(self) -> bool:
        """Whether N = 0 at v = 0."""
        return self.force_at_rest <= 0
