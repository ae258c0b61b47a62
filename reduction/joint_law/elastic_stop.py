"""One-sided elastic stop without friction."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.elastic_energy import compute_spring_energy_about_mean
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class ElasticStop(DirectedJoint):
    """f = stiffness max(u - gap, 0): a one-sided stop without friction.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, positive towards the stop, shape (r,) [-].
    stiffness
        Stiffness of the closed stop [N/m].
    gap
        Gap [m]; negative for a pre-compressed stop.

    Raises
    ------
    JointError
        A stiffness that is not positive, or a number that is not finite.
    """

    kind = "stop"
    parameters = (
        LawParameter(name="stiffness", unit="N/m", meaning="k", typical=1e6, positive=True),
        LawParameter(name="gap", unit="m", meaning="negative for a pre-compressed stop", typical=1e-5, default=0.0),
    )
    typical_displacement = 2e-5
    can_slip = False
    one_sided = True
    n_slider = 0
    stuck_stiffness = (0.0,)  # it may be open at rest
    nlvib = ("unilateralSpring", {"stiffness": "stiffness", "gap": "gap"})

    stiffness: float
    gap: float = 0.0

    @property
    def reference_stiffness(self) -> tuple[float, ...]:
        """Stiffness if the stop is closed at rest, else 0 [N/m]."""
        return (self.stiffness if self.gap < 0 else 0.0,)

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy about the mean displacement."""
        stiffness, gap = parameters["stiffness"], parameters["gap"]

        def indentation(x: Row) -> Row:
            return np.maximum(x - gap, 0.0)

        return compute_spring_energy_about_mean(
            lambda x: stiffness / 2 * indentation(x) ** 2, lambda x: stiffness * indentation(x), displacement[0]
        )

    def pyharm(self, scale: float) -> Mapping[str, Any]:
        """Connector PenaltyUnilateralGap of pyHarm."""
        return {"type": "PenaltyUnilateralGap", "k": scale**2 * self.stiffness, "g": self.gap / scale}
