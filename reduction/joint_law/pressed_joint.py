"""Base of contacts: a unilateral normal spring with a preload or a gap."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.elastic_energy import compute_spring_energy_about_mean
from reduction.joint_law.registry import Joint, Plausible

#: Friction coefficients: clean metals in vacuum and soft rubber reach a few units (Bowden and Tabor, 1950). With larger
#: ones contacts wedge: curves fold thousands of times, or there is no steady state.
PLAUSIBLE_FRICTION = Plausible(
    10.0,
    "is beyond that of any two solids (0 to 10): divide it by 100 if it is in percent, or use a spring instead of a "
    "contact that never slips",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class PressedJoint(Joint):
    """N = max(N_0 + k_n (v - g), 0) along its last direction; v > 0 closes.

    Parameters
    ----------
    name
        What messages and results call it.
    normal
        Row of v, shape (r,) [-].
    normal_stiffness
        k_n [N/m].
    preload
        N_0 [N], the normal force at v = g; negative holds the contact open by that force.
    gap
        g [m]; negative is an interference.
    """

    name: str
    normal: Row
    normal_stiffness: float
    preload: float = 0.0
    gap: float = 0.0

    @property
    def force_at_rest(self) -> float:
        """N at v = 0 [N]; zero where the contact is open."""
        return max(self.preload - self.normal_stiffness * self.gap, 0.0)

    @property
    def stuck_force(self) -> tuple[float, ...]:
        """N_0 - k_n g in the normal [N]."""
        return (0.0,) * self.normal_direction + (self.preload - self.normal_stiffness * self.gap,)

    @property
    def normal_direction(self) -> int:
        """The last."""
        return len(self.directions) - 1

    def normal_energy(self, parameters: Mapping[str, float], displacement: Row) -> Row:
        """N^2 / (2 k_n) about the mean of v, shape (n,) [J]; arguments as of `spring_energy`, of the normal alone."""
        stiffness, preload, gap = (parameters[name] for name in ("normal_stiffness", "preload", "gap"))

        def force(v: Row) -> Row:
            return np.maximum(preload + stiffness * (v - gap), 0.0)

        return compute_spring_energy_about_mean(lambda v: force(v) ** 2 / (2 * stiffness), force, displacement)

    @property
    def open_at_rest(self) -> bool:
        """N = 0 at v = 0."""
        return self.force_at_rest <= 0
