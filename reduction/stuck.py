"""A structure with all its sliders stuck, and its damping by the first mode that it has then."""

from collections.abc import Iterable
from math import pi

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.damping import rayleigh_damping
from fe.dense_modes import dense_modes
from reduction.joint import FrictionContact, JenkinsElement, Joint

Matrix = Float[NDArray[np.float64], "r r"]

#: lambda / (lambda + sigma) of a rigid-body motion; that of the lowest elastic mode is 1/2.
RIGID = 1e-6
#: Share of omega^2 below which the structure's own stiffness counts for nothing in a mode.
FREE = 1e-9
#: Share of what a row sees of the mode that moves most along it, among the first of `LOOKED_AT`, that counts as seen.
SEEN, LOOKED_AT = 0.01, 10


def stuck_stiffness(stiffness: Matrix, joints: Iterable[Joint]) -> Matrix:
    """Stiffness with the springs of all sliders, and with all contacts closed, shape (r, r) [N/m].

    Parameters
    ----------
    stiffness
        Of the structure without its joints, shape (r, r) [N/m].
    joints
        Contacts and sliders count; all others add nothing.
    """
    stuck = np.array(stiffness)
    for joint in joints:
        if isinstance(joint, FrictionContact):
            stuck += joint.tangential_stiffness * joint.tangents.T @ joint.tangents
            stuck += joint.normal_stiffness * np.outer(joint.normal, joint.normal)
        elif isinstance(joint, JenkinsElement):
            stuck += joint.tangential_stiffness * np.outer(joint.direction, joint.direction)
    return stuck


def stuck_damping(
    mass: Matrix,
    stiffness: Matrix,
    stuck: Matrix,
    ratio: float,
    seen: Float[NDArray[np.float64], " r"] | None = None,
) -> Matrix:
    r"""Rayleigh damping with a given ratio on the first elastic mode of the stuck structure, shape (r, r) [N s/m].

    C = alpha M + beta K, half of the ratio from each. K is the structure without its contact springs, so that contacts
    that slide or open take no damping with them; for that, beta is larger by what they have of the mode's stiffness,

    .. math:: \alpha = \zeta \omega, \quad \beta = \zeta \omega / (\varphi^T K \varphi), \quad \varphi^T M \varphi = 1 .

    Where contacts alone hold the body in this mode, all of the damping is from its mass.

    Parameters
    ----------
    mass, stiffness
        Without contacts, shape (r, r) [kg, N/m].
    stuck
        Stiffness with them, see `stuck_stiffness` [N/m].
    ratio
        zeta [-].
    seen
        A row, such as that of the force: the mode is the first one that moves along it. A damper that rolls about its
        line of contact is lower than the blade, and no force on the blade drives it. Any elastic mode by default.

    Raises
    ------
    InputError
        A ratio outside [0, 1).
    """
    modes = dense_modes(mass, stuck)
    elastic = np.flatnonzero(1 - modes.shift * modes.mu > RIGID)[:LOOKED_AT]
    along = np.ones(len(elastic)) if seen is None else np.abs(seen @ modes.shapes[:, elastic])
    along = along / np.sqrt(modes.mu[elastic]) if seen is not None else along
    first = int(elastic[np.argmax(along >= SEEN * along.max())])
    omega = float(np.sqrt(modes.lambda_[first]))
    damping = rayleigh_damping(ratio, omega / (2 * pi))
    shape = modes.shapes[:, first] / np.sqrt(modes.mu[first])
    own = float(shape @ stiffness @ shape)
    if own < FREE * omega**2:
        return np.asarray(2 * damping.mass_factor * mass)
    return np.asarray(damping.mass_factor * mass + damping.stiffness_factor * omega**2 / own * stiffness)
