"""Spring beyond a clearance on either side."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.elastic_energy import compute_spring_energy_about_mean
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class Play(DirectedJoint):
    """f = stiffness (u - gap) above the gap, stiffness (u + gap) below -gap, 0 in between.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    stiffness
        Stiffness beyond the gap [N/m].
    gap
        Clearance on either side [m].

    Raises
    ------
    JointError
        A stiffness that is not positive, a negative gap, or a number that is not finite.
    """

    kind = "play"
    parameters = (
        LawParameter(name="stiffness", unit="N/m", meaning="k beyond the gap", typical=1e6, positive=True),
        LawParameter(name="gap", unit="m", meaning="clearance on either side", typical=1e-5, lower=0.0),
    )
    typical_displacement = 2e-5
    can_slip = False
    n_slider = 0
    stuck_stiffness = (0.0,)  # it may be open at rest

    stiffness: float
    gap: float

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy about the mean displacement."""
        stiffness, gap = parameters["stiffness"], parameters["gap"]

        def beyond(x: Row) -> Row:
            return x - np.clip(x, -gap, gap)

        return compute_spring_energy_about_mean(
            lambda x: stiffness / 2 * beyond(x) ** 2, lambda x: stiffness * beyond(x), displacement[0]
        )
