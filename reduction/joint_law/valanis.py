r"""Hysteresis of Valanis, in the form of Gaul and Lenz for bolted joints.

.. math:: \dot f = \frac{E_0 \dot u \left[1 + \frac{\lambda}{E_0} \operatorname{sgn}(\dot u) (E_t u - f)\right]}
          {1 + \kappa \frac{\lambda}{E_0} \operatorname{sgn}(\dot u) (E_t u - f)}, \qquad
          \lambda = \frac{E_0 (E_0 - E_t)}{F (E_0 - \kappa E_t)}

Here :math:`E_0 = k`, :math:`E_t = k_s`, and :math:`F` is the force beyond :math:`k_s u` at large motions; the force at
which both asymptotes meet is :math:`\sigma_0 = F / (1 - k_s / k)`.

References
----------
Gaul and Lenz, Nonlinear dynamics of structures assembled by bolted joints, Acta Mechanica 125 (1997), 169-181.
"""

from dataclasses import dataclass

from reduction.errors import JointError
from reduction.joint_law.hysteretic_joint import HYSTERESIS, HystereticJoint
from reduction.joint_law.registry import LAWS, LawParameter


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class ValanisJoint(HystereticJoint):
    """Micro-slip of a bolted joint along one row.

    Parameters
    ----------
    name, direction, tangential_stiffness, limit_force, slip_stiffness
        As in `HystereticJoint`: k, F and k_s.
    kappa
        Parameter kappa, from 0 to below 1: a larger value gives a sharper knee with less micro-slip before it [-].

    Raises
    ------
    JointError
        A kappa outside 0 to 1, or as in `HystereticJoint`.
    """

    kind = "valanis"
    parameters = (
        *HYSTERESIS,
        LawParameter(
            name="kappa", unit="-", meaning="sharpness of the knee, below 1", typical=0.6, lower=0.0, is_form=True
        ),
    )
    typical_displacement = 3e-5

    kappa: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kappa >= 1:
            raise JointError(f'joint "{self.name}": kappa = {self.kappa:g} must be below 1')
