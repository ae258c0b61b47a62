r"""Contact with different friction and tangential stiffness along its two tangents, as on machined surfaces.

.. math:: T_i = k_i (u_i - w_i), \qquad
          \left(\frac{T_1}{\mu_1 N}\right)^2 + \left(\frac{T_2}{\mu_2 N}\right)^2 \le 1

The slider moves along the elongation :math:`u - w` of its spring. If both stiffnesses are equal, the friction force
opposes the sliding; if :math:`k_1 / \mu_1^2 = k_2 / \mu_2^2`, the sliding is normal to the ellipse (maximum
dissipation). With :math:`\bar u_2 = c\, u_2` and :math:`c = k_2 \mu_1 / (k_1 \mu_2)` it is the isotropic contact of
stiffness :math:`k_1` and friction :math:`\mu_1`.

References
----------
Mroz and Stupkiewicz, An anisotropic friction and wear model, Int. J. Solids Structures 31 (1994), 1113-1131: limit
ellipses and rules of sliding.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from reduction.array_type import Real, Row
from reduction.errors import JointError
from reduction.joint_law.pressed_joint import PLAUSIBLE_FRICTION, PressedJoint
from reduction.joint_law.registry import LAWS, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionEllipse(PressedJoint):
    """Contact with two tangents and an elliptic friction limit.

    Parameters
    ----------
    name, normal, normal_stiffness, preload, gap
        As in `PressedJoint`.
    tangent, second_tangent
        Rows of u_1 and u_2, shape (r,) each [-].
    tangential_stiffness, second_tangential_stiffness
        Tangential stiffnesses k_1 and k_2 [N/m].
    friction_coefficient, second_friction_coefficient
        Friction coefficients mu_1 and mu_2, the half axes of the ellipse over N [-].

    Raises
    ------
    JointError
        A stiffness or a friction coefficient that is not positive, a friction coefficient above 10, rows of different
        lengths, or a number that is not finite.
    """

    kind = "friction_ellipse"
    parameters = (
        LawParameter(name="tangential_stiffness", unit="N/m", meaning="k_1", typical=1e6, positive=True),
        LawParameter(name="normal_stiffness", unit="N/m", meaning="k_n", typical=1e6, positive=True),
        LawParameter(
            name="friction_coefficient",
            unit="-",
            meaning="mu_1",
            typical=0.4,
            positive=True,
            plausible=PLAUSIBLE_FRICTION,
        ),
        LawParameter(name="preload", unit="N", meaning="N_0, the normal force at v = g", typical=30.0, default=0.0),
        LawParameter(name="gap", unit="m", meaning="g, negative for an interference", typical=0.0, default=0.0),
        LawParameter(name="second_tangential_stiffness", unit="N/m", meaning="k_2", typical=6e5, positive=True),
        LawParameter(
            name="second_friction_coefficient",
            unit="-",
            meaning="mu_2",
            typical=0.3,
            positive=True,
            plausible=PLAUSIBLE_FRICTION,
        ),
    )
    typical_displacement = 3e-5
    places = {"normal": True, "tangent": True, "second_tangent": True}  # noqa: RUF012  # never modified
    series_springs = True
    n_slider = 2

    tangent: Row
    second_tangent: Row
    tangential_stiffness: float
    second_tangential_stiffness: float
    friction_coefficient: float
    second_friction_coefficient: float

    def __post_init__(self) -> None:
        self.check_fields("normal", "tangent", "second_tangent")
        sizes = {self.normal.size, self.tangent.size, self.second_tangent.size}
        if len(sizes) > 1:
            raise JointError(
                f'joint "{self.name}" has a normal over {self.normal.size} degrees of freedom but tangents over '
                f"{self.tangent.size} and {self.second_tangent.size}: all are rows over the whole structure"
            )

    @property
    def directions(self) -> Float[Real, "3 r"]:
        """Tangents, then the normal, shape (3, r) [-]."""
        return np.vstack([self.tangent, self.second_tangent, self.normal])

    @property
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffnesses k_1, k_2 and k_n [N/m]."""
        return (self.tangential_stiffness, self.second_tangential_stiffness, self.normal_stiffness)

    @property
    def slider_intervals(self) -> str:
        """Reason why there is no interval: the limit is an ellipse."""
        return "has one elliptic limit for both tangents: use uncoupled friction, or one tangent"

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy T_i^2 / (2 k_i) of the tangents, plus that of the normal spring."""
        springs = np.array([parameters[name] for name in ("tangential_stiffness", "second_tangential_stiffness")])
        return np.asarray(0.5 / springs @ force[:-1] ** 2 + self.normal_energy(parameters, displacement[-1]))
