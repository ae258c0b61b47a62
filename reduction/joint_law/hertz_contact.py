"""Hertzian contact: a one-sided force that is a power of the indentation."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.elastic_energy import compute_spring_energy_about_mean
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class HertzContact(DirectedJoint):
    """f = stiffness reference (max(u - gap, 0) / reference)^exponent, without friction.

    Hertz's point contact of two bodies has the exponent 3/2. Rough surfaces have larger exponents.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, positive towards the contact, shape (r,) [-].
    stiffness
        Force over indentation at the reference [N/m].
    reference
        Reference indentation [m].
    exponent
        Exponent of the indentation, at least 1; 3/2 by default [-].
    gap
        Gap [m]; negative for an indentation at rest.

    Raises
    ------
    JointError
        A stiffness or a reference that is not positive, an exponent below 1, or a number that is not finite.

    References
    ----------
    Johnson, Contact Mechanics, Cambridge (1985), chapter 4.
    """

    kind = "hertz"
    parameters = (
        LawParameter(name="stiffness", unit="N/m", meaning="f / u at the reference", typical=1e6, positive=True),
        LawParameter(name="reference", unit="m", meaning="indentation", typical=1e-5, positive=True, is_form=True),
        LawParameter(
            name="exponent", unit="-", meaning="of the indentation", typical=1.5, lower=1.0, default=1.5, is_form=True
        ),
        LawParameter(name="gap", unit="m", meaning="negative for an indentation at rest", typical=-5e-6, default=0.0),
    )
    typical_displacement = 2e-5
    can_slip = False
    one_sided = True
    n_slider = 0
    stuck_stiffness = (0.0,)  # it may be open at rest

    stiffness: float
    reference: float
    exponent: float = 1.5
    gap: float = 0.0

    @property
    def reference_stiffness(self) -> tuple[float, ...]:
        """Tangent stiffness at u = 0, if it is closed at rest [N/m]."""
        power = self.exponent - 1
        return (self.stiffness * self.exponent * (-self.gap / self.reference) ** power if self.gap < 0 else 0.0,)

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy about the mean displacement."""
        k, r, p, gap = (parameters[item.name] for item in self.parameters)

        def indentation(x: Row) -> Row:
            return np.maximum(x - gap, 0.0) / r

        return compute_spring_energy_about_mean(
            lambda x: k * r**2 / (p + 1) * indentation(x) ** (p + 1),
            lambda x: k * r * indentation(x) ** p,
            displacement[0],
        )
