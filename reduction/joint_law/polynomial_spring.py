"""Spring whose force is a polynomial of the displacement, with even and odd powers."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.elastic_energy import compute_spring_energy_about_mean
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class PolynomialSpring(DirectedJoint):
    """f = quadratic u^2 + cubic u^3 + quartic u^4 + quintic u^5.

    Even powers make the spring stiffer on one side, as for a curved or preloaded structure.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    quadratic, cubic, quartic, quintic
        Coefficients [N/m^2], [N/m^3], [N/m^4] and [N/m^5], of either sign; 0 by default.

    Raises
    ------
    JointError
        A number that is not finite.
    """

    kind = "polynomial"
    parameters = (
        LawParameter(name="quadratic", unit="N/m^2", meaning="f / u^2, of either sign", typical=2e10, default=0.0),
        LawParameter(name="cubic", unit="N/m^3", meaning="f / u^3, of either sign", typical=1e15, default=0.0),
        LawParameter(name="quartic", unit="N/m^4", meaning="f / u^4, of either sign", typical=5e19, default=0.0),
        LawParameter(name="quintic", unit="N/m^5", meaning="f / u^5, of either sign", typical=2.5e24, default=0.0),
    )
    typical_displacement = 2e-5
    one_sided = True
    n_slider = 0
    stuck_stiffness = (0.0,)

    quadratic: float = 0.0
    cubic: float = 0.0
    quartic: float = 0.0
    quintic: float = 0.0

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy about the mean displacement."""
        factors = [parameters[item.name] for item in self.parameters]
        force_of = np.polynomial.Polynomial([0.0, 0.0, *factors])
        return compute_spring_energy_about_mean(force_of.integ(), force_of, displacement[0])
