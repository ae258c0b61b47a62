"""Spring whose force is a power of the displacement."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.elastic_energy import compute_spring_energy_about_mean
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class PowerSpring(DirectedJoint):
    """f = stiffness u abs(u / reference)^(exponent - 1).

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    stiffness
        Force over displacement at the reference [N/m], of either sign.
    reference
        Reference displacement [m].
    exponent
        Exponent of the displacement, at least 1 [-].

    Raises
    ------
    JointError
        A reference that is not positive, an exponent below 1, or a number that is not finite.
    """

    kind = "power"
    parameters = (
        LawParameter(name="stiffness", unit="N/m", meaning="f / u at the reference, of either sign", typical=4e5),
        LawParameter(name="reference", unit="m", meaning="displacement", typical=2e-5, positive=True, is_form=True),
        LawParameter(name="exponent", unit="-", meaning="of the displacement", typical=2.5, lower=1.0, is_form=True),
    )
    typical_displacement = 2e-5
    n_slider = 0
    stuck_stiffness = (0.0,)

    stiffness: float
    reference: float
    exponent: float

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy about the mean displacement."""
        k, r, p = (parameters[name] for name in ("stiffness", "reference", "exponent"))
        return compute_spring_energy_about_mean(
            lambda x: k * r**2 / (p + 1) * np.abs(x / r) ** (p + 1),
            lambda x: k * x * np.abs(x / r) ** (p - 1),
            displacement[0],
        )
