"""Jenkins element: a spring and a slider in series."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples, SliderInterval


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class JenkinsElement(DirectedJoint):
    r"""Spring and slider in series with a constant limit: T = k_t (u - w), abs(T) <= limit_force.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    tangential_stiffness
        Stiffness k_t of the spring [N/m].
    limit_force
        Limit force mu N of the slider [N].

    Raises
    ------
    JointError
        A stiffness that is not positive, a negative limit, or a number that is not finite.
    """

    kind = "jenkins"
    parameters = (
        LawParameter(name="tangential_stiffness", unit="N/m", meaning="k_t", typical=1e6, positive=True),
        LawParameter(name="limit_force", unit="N", meaning="mu N", typical=10.0, lower=0.0),
    )
    typical_displacement = 2e-5
    series_springs = True
    n_slider = 1
    nlvib = ("elasticDryFriction", {"stiffness": "tangential_stiffness", "friction_limit_force": "limit_force"})

    tangential_stiffness: float
    limit_force: float

    @property
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffness k_t [N/m]."""
        return (self.tangential_stiffness,)

    @property
    def slider_intervals(self) -> tuple[SliderInterval, ...]:
        """Interval of the slider, with a constant limit."""
        return (SliderInterval(0, -1, self.tangential_stiffness, self.limit_force, 0.0),)

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy T^2 / (2 k_t)."""
        return np.asarray(force[0] ** 2 / (2 * parameters["tangential_stiffness"]))

    def pyharm(self, scale: float) -> Mapping[str, Any]:
        """Connector Jenkins of pyHarm with a constant normal force."""
        stiffness = scale**2 * self.tangential_stiffness
        return {"type": "Jenkins", "mu": 1.0, "N0": scale * self.limit_force, "k": stiffness}
