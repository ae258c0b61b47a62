"""One-sided piecewise linear spring, for a measured or identified force without a formula."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class PiecewiseSpring(DirectedJoint):
    """f = sum of stiffness[i] max(u - i width, 0), i = 0, 1, ...: one-sided, with a kink at each i width.

    A second spring in the opposite direction gives the force for u < 0.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, positive towards the side where the spring acts, shape (r,) [-].
    width
        Width of a piece [m].
    stiffness
        Change of the slope df/du at 0, width, 2 width, ..., of either sign, a list [N/m].

    Raises
    ------
    JointError
        A width that is not positive, or a number that is not finite.
    """

    kind = "piecewise_spring"
    parameters = (
        LawParameter(name="width", unit="m", meaning="of a piece", typical=6e-6, positive=True),
        LawParameter(
            name="stiffness", unit="N/m", meaning="change at 0, width, 2 width, ..., a list", typical=4e5, is_list=True
        ),
    )
    typical_displacement = 2e-5
    one_sided = True
    n_slider = 0
    stuck_stiffness = (0.0,)

    width: float
    stiffness: tuple[float, ...]

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy about the mean displacement."""
        changes = np.array([parameters[name] for name in self.parameters[1].names(self)])
        begin = parameters["width"] * np.arange(len(changes))

        def ramps(x: Row) -> Samples:
            return np.maximum(x[:, None] - begin, 0.0)

        u = displacement[0]
        at_mean = ramps(u.mean()[None])
        stored = (ramps(u) ** 2 - at_mean**2) @ changes / 2
        return np.asarray(stored - (at_mean @ changes) * (u - u.mean()))
