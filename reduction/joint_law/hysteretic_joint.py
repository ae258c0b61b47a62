"""Base class of smooth hysteresis laws: a yielding spring in parallel with an elastic spring."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.errors import JointError
from reduction.joint_law.parallel_sliders import compute_vibration_energy
from reduction.joint_law.registry import DirectedJoint, LawParameter, Samples

#: First parameters of all smooth hysteresis laws.
HYSTERESIS = (
    LawParameter(name="tangential_stiffness", unit="N/m", meaning="k, about rest", typical=1e6, positive=True),
    LawParameter(name="slip_stiffness", unit="N/m", meaning="k_s, in slip", typical=1e5, lower=0.0, default=0.0),
    LawParameter(name="limit_force", unit="N", meaning="F, beyond that of k_s", typical=9.0, positive=True),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class HystereticJoint(DirectedJoint):
    """f = k_s u + (k - k_s) z, where abs(z) < z_y = F / (k - k_s) saturates as the motion grows.

    z is the elongation of the yielding spring [m]; the state of the joint is its other end, u - z.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    tangential_stiffness
        Stiffness k about rest [N/m].
    limit_force
        Limit F of the force beyond that of k_s [N].
    slip_stiffness
        Stiffness k_s in slip, below k [N/m]; 0 by default.

    Raises
    ------
    JointError
        A stiffness or a limit that is not positive, a slip stiffness outside 0 to k, or a number that is not finite.
    """

    n_slider = 1

    tangential_stiffness: float
    limit_force: float
    slip_stiffness: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.slip_stiffness >= self.tangential_stiffness:
            raise JointError(
                f'joint "{self.name}": slip_stiffness = {self.slip_stiffness:g} must be below tangential_stiffness = '
                f"{self.tangential_stiffness:g}"
            )

    @property
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffness k for small displacements [N/m]."""
        return (self.tangential_stiffness,)

    @property
    def slider_intervals(self) -> str:
        """Reason why there is no interval: the joint yields at any force."""
        return "yields at any force and has no interval of stick: remove it, or use jenkins"

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy of both springs, each about its mean elongation."""
        k, slip = parameters["tangential_stiffness"], parameters["slip_stiffness"]
        ends = np.vstack([np.zeros(displacement.shape[1]), slider[0]])
        return compute_vibration_energy(np.array([slip, k - slip]), displacement[0], ends)
