r"""Hysteresis of Bouc and Wen.

.. math:: f = k_s u + (k - k_s)\, z, \qquad
          \frac{dz}{dt} = \dot u - \left(\beta\, |\dot u|\, z + (1 - \beta)\, \dot u\, |z|\right)
          \frac{|z|^{n-1}}{z_y^n}, \qquad z_y = \frac{F}{k - k_s}

The usual constants are :math:`A = 1`, :math:`\beta / z_y^n` and :math:`\gamma = (1 - \beta) / z_y^n`, so that the force
tends to :math:`k_s u \pm F` for any values. For :math:`\beta \ge 1/2` it never supplies energy.

References
----------
Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976), 249-263.
Ismail, Ikhouane and Rodellar, The hysteresis Bouc-Wen model, a survey, Arch. Comput. Methods Eng. 16 (2009), 161-188.
"""

from dataclasses import dataclass

from reduction.joint_law.hysteretic_joint import HYSTERESIS, HystereticJoint
from reduction.joint_law.registry import LAWS, LawParameter


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class BoucWenJoint(HystereticJoint):
    """Spring that yields smoothly along one row.

    Parameters
    ----------
    name, direction, tangential_stiffness, limit_force, slip_stiffness
        As in `HystereticJoint`: k, F and k_s.
    exponent
        Exponent n, at least 1; the knee is sharper for a larger n [-].
    shape
        Shape parameter beta, at least 1/2. Unloading is elastic at 1/2; at 1 it is not, and loops are slimmer [-].

    Raises
    ------
    JointError
        An exponent or a shape below its bound, or as in `HystereticJoint`.
    """

    kind = "bouc_wen"
    parameters = (
        *HYSTERESIS,
        LawParameter(
            name="exponent", unit="-", meaning="n, sharpness of the knee", typical=2.0, lower=1.0, is_form=True
        ),
        LawParameter(name="shape", unit="-", meaning="beta", typical=0.7, lower=0.5, default=0.5, is_form=True),
    )
    typical_displacement = 3e-5

    exponent: float
    shape: float = 0.5
