r"""Contact forces as the rig measures them: from two load cells behind each de-coupler, without any inertia.

A de-coupler passes its damper's push on through two arms at +-alpha. With the taper theta of the contact line, a force
N normal to it and T along it balance the forces R_3 and R_4 of the arms (eq. 1),

.. math:: T \cos\theta + N \sin\theta = (R_3 + R_4) \cos\alpha, \qquad
          N \cos\theta - T \sin\theta = (R_3 - R_4) \sin\alpha ,

and the damper's own balance, with the dead weight CF, gives those on the blade (eq. 2),

.. math:: T'' \cos\theta + N'' \sin\theta = T' \cos\theta + N' \sin\theta, \qquad
          N'' \cos\theta - T'' \sin\theta = CF + T' \sin\theta - N' \cos\theta .

Both are rotations by theta. R_3 and R_4 push along their arms, towards the rig's middle where they are positive in
the first sum; T is positive where it acts like them along the damper's axis.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 2.2, eqs 1 and 2.
"""

from math import cos, sin
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Numbers, time histories or harmonics [N].
Force = NDArray[Any] | complex


class LineReaction(NamedTuple):
    """Of one contact line."""

    tangential: NDArray[Any]
    """T [N]."""
    normal: NDArray[Any]
    """N [N]."""


def decoupler_contact(r3: Force, r4: Force, theta: float, alpha: float) -> LineReaction:
    """Forces between damper and de-coupler from those of the load cells, eq. 1.

    Parameters
    ----------
    r3, r4
        Forces along the two arms [N].
    theta
        Taper of the contact line [rad].
    alpha
        Angle of the arms [rad].
    """
    along, up = (np.asarray(r3) + r4) * cos(alpha), (np.asarray(r3) - r4) * sin(alpha)
    return along_line(along, up, theta)


def blade_contact(decoupler: LineReaction, dead_weight: Force, theta: float) -> LineReaction:
    """Forces between damper and blade from those between damper and de-coupler, eq. 2.

    Parameters
    ----------
    decoupler
        T' and N' [N].
    dead_weight
        CF, what pulls the damper up [N]; of harmonics, it belongs to the mean alone.
    theta
        Taper of the contact lines [rad].
    """
    T, N = decoupler
    along = T * cos(theta) + N * sin(theta)
    up = dead_weight - (N * cos(theta) - T * sin(theta))
    return along_line(along, np.asarray(up), theta)


def along_line(along: NDArray[Any], up: NDArray[Any], theta: float) -> LineReaction:
    """Parts along a contact line and normal to it, of a force with parts along the damper's axis and up [N]."""
    return LineReaction(
        tangential=np.asarray(along * cos(theta) - up * sin(theta)),
        normal=np.asarray(along * sin(theta) + up * cos(theta)),
    )
