"""Cubic spring."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class CubicSpring(DirectedJoint):
    """f = stiffness u^3.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    stiffness
        Coefficient of u^3, of either sign [N/m^3].

    Raises
    ------
    JointError
        A number that is not finite.
    """

    kind = "cubic"
    parameters = (LawParameter(name="stiffness", unit="N/m^3", meaning="f / u^3, of either sign", typical=1e15),)
    typical_displacement = 2e-5
    n_slider = 0
    stuck_stiffness = (0.0,)
    nlvib = ("cubicSpring", {"stiffness": "stiffness"})

    stiffness: float

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy about the mean displacement."""
        mean = displacement[0].mean()
        u = displacement[0] - mean
        return np.asarray(parameters["stiffness"] * u**2 * (1.5 * mean**2 + mean * u + u**2 / 4))

    def pyharm(self, scale: float) -> Mapping[str, Any]:
        """Connector CubicSpring of pyHarm."""
        return {"type": "CubicSpring", "k": scale**4 * self.stiffness}
