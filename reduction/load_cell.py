r"""Contact forces as measured in the rig by two load cells behind each de-coupler, without inertia.

A de-coupler transmits the force of its damper through two arms at +-alpha. With the taper theta of the contact line, a
force N normal to it and T along it balance the forces R_3 and R_4 of the arms (eq. 1),

.. math:: T \cos\theta + N \sin\theta = (R_3 + R_4) \cos\alpha, \qquad
          N \cos\theta - T \sin\theta = (R_3 - R_4) \sin\alpha ,

and the equilibrium of the damper, with the dead weight CF, gives the forces on the blade (eq. 2),

.. math:: T'' \cos\theta + N'' \sin\theta = T' \cos\theta + N' \sin\theta, \qquad
          N'' \cos\theta - T'' \sin\theta = CF + T' \sin\theta - N' \cos\theta .

Both equations are rotations by theta. R_3 and R_4 act along their arms, and are positive towards the middle of the rig;
T is positive if it acts in the same direction along the axis of the damper.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 2.2, eqs 1 and 2.
"""

from math import cos, sin
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

#: Numbers, time histories or harmonics [N].
Force = NDArray[Any] | complex


class LineReaction(NamedTuple):
    """Forces of a contact line."""

    tangential: NDArray[Any]
    """Tangential force T [N]."""
    normal: NDArray[Any]
    """Normal force N [N]."""


def compute_decoupler_contact(r3: Force, r4: Force, theta: float, alpha: float) -> LineReaction:
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
    return resolve_along_line(along, up, theta)


def compute_blade_contact(decoupler: LineReaction, dead_weight: Force, theta: float) -> LineReaction:
    """Forces between damper and blade from those between damper and de-coupler, eq. 2.

    Parameters
    ----------
    decoupler
        Forces T' and N' of the line on the de-coupler [N].
    dead_weight
        Dead weight CF, which pulls the damper up [N]; for harmonics, it acts in the mean only.
    theta
        Taper of the contact lines [rad].
    """
    T, N = decoupler
    along = T * cos(theta) + N * sin(theta)
    up = dead_weight - (N * cos(theta) - T * sin(theta))
    return resolve_along_line(along, np.asarray(up), theta)


def resolve_along_line(along: NDArray[Any], up: NDArray[Any], theta: float) -> LineReaction:
    """Components along and normal to a contact line, of a force with components along the damper's axis and up [N]."""
    return LineReaction(
        tangential=np.asarray(along * cos(theta) - up * sin(theta)),
        normal=np.asarray(along * sin(theta) + up * cos(theta)),
    )


def contact_jacobian(
    r3: float, r4: float, theta: float, alpha: float, dead_weight: float | None = None
) -> Float[NDArray[np.float64], "2 5"]:
    r"""Derivatives of T and N with respect to R_3, R_4, theta, alpha and CF, of eq. 1, or of eq. 2 with a dead weight.

    Parameters
    ----------
    r3, r4
        Forces along the two arms, means or amplitudes in phase [N].
    theta, alpha
        Taper of the contact line and angle of the arms [rad].
    dead_weight
        Dead weight CF, for a line on the blade [N]; None for a line on the de-coupler.

    Returns
    -------
    Derivatives of T, then of N, shape (2, 5) [-, N/rad].
    """
    sign, weight = (1.0, 0.0) if dead_weight is None else (-1.0, 1.0)
    own = compute_decoupler_contact(r3, r4, theta, alpha)
    line = own if dead_weight is None else compute_blade_contact(own, dead_weight, theta)
    # Components along the damper's axis and up; on the blade, up = CF - up of the de-coupler.
    along = [cos(alpha), cos(alpha), 0.0, -(r3 + r4) * sin(alpha), 0.0]
    up = [sign * sin(alpha), -sign * sin(alpha), 0.0, sign * (r3 - r4) * cos(alpha), weight]
    result = np.array(resolve_along_line(np.array(along), np.array(up), theta))
    # With theta the line rotates, but the force does not.
    result[:, 2] = [-float(line.normal), float(line.tangential)]
    return result


def contact_covariance(
    jacobian: Float[NDArray[np.float64], "2 5"],
    cells: Float[NDArray[np.float64], "2 2"],
    theta: float = 0.0,
    alpha: float = 0.0,
    dead_weight: float = 0.0,
) -> Float[NDArray[np.float64], "2 2"]:
    """Covariance of T and N, to first order, shape (2, 2) [N^2].

    Parameters
    ----------
    jacobian
        Jacobian from `contact_jacobian`.
    cells
        Covariance of both load cells from noise and common gain errors, shape (2, 2) [N^2].
    theta, alpha, dead_weight
        Standard deviations of the angles [rad] and of the dead weight [N]; these are errors of the set-up, equal in all
        readings.
    """
    whole = np.zeros((5, 5))
    whole[:2, :2] = cells
    whole[range(2, 5), range(2, 5)] = theta**2, alpha**2, dead_weight**2
    return np.asarray(jacobian @ whole @ jacobian.T)
