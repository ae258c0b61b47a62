"""Jenkins elements in parallel with a spring: a piecewise linear hysteresis loop."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.errors import JointError
from reduction.joint_law.parallel_sliders import compute_vibration_energy
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class JenkinsChain(DirectedJoint):
    r"""Jenkins elements in parallel: f = stiffness u + the sum of T_i, T_i = k_i (u - w_i), abs(T_i) <= limit_i.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    tangential_stiffness
        Stiffness k_i of each element [N/m]; a single number is a list of one.
    limit_force
        Limit force of each element [N].
    stiffness
        Stiffness of the parallel spring [N/m]; 0 by default.

    Raises
    ------
    JointError
        An empty list, lists of different lengths, a k_i that is not positive, a negative limit or stiffness, or a
        number that is not finite.
    """

    kind = "jenkins_chain"
    parameters = (
        LawParameter(
            name="tangential_stiffness", unit="N/m", meaning="k_i, a list", typical=4e5, positive=True, is_list=True
        ),
        LawParameter(name="limit_force", unit="N", meaning="of each, a list", typical=4.0, lower=0.0, is_list=True),
        LawParameter(name="stiffness", unit="N/m", meaning="beside them", typical=1e5, lower=0.0, default=0.0),
    )
    typical_displacement = 2e-5

    tangential_stiffness: tuple[float, ...]
    limit_force: tuple[float, ...]
    stiffness: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        springs, sliders = len(self.tangential_stiffness), len(self.limit_force)
        if springs != sliders:
            raise JointError(
                f'joint "{self.name}": tangential_stiffness has {springs} numbers and limit_force {sliders}: give '
                "one of each per element"
            )

    @property
    def n_slider(self) -> int:
        """Number of sliders: one per element."""
        return len(self.limit_force)

    @property
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffness of all elements and the spring [N/m]."""
        return (sum(self.tangential_stiffness) + self.stiffness,)

    @property
    def slider_intervals(self) -> str:
        """Reason why there is no interval: limits are searched for one slider per motion."""
        return "has several sliders on one motion: give each as a separate joint of the law jenkins"

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy of all springs, each about its mean elongation."""
        springs = np.array([parameters[name] for name in self.parameters[0].names(self)] + [parameters["stiffness"]])
        return compute_vibration_energy(springs, displacement[0], np.vstack([slider, np.zeros(slider.shape[1])]))
