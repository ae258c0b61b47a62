"""Stiffness of a structure with all sliders stuck, and damping by its first elastic mode in this state."""

from collections.abc import Iterable
from math import pi

import numpy as np

from fe.damping import rayleigh_damping
from fe.dense_modes import compute_dense_modes
from reduction.array_type import Array, Matrix, Real
from reduction.errors import JointError
from reduction.joint_law.registry import Joint

#: Value of lambda / (lambda + sigma) below which a mode is a rigid-body motion; it is 1/2 for the lowest elastic mode.
RIGID = 1e-6
#: Smallest motion of a mode along the rows `seen`, relative to the mode with the largest motion, and number of modes
#: that are compared. A force near the root of a blade excites first bending by 0.6 to 5 % of higher modes, with
#: contacts of 4 to 20 N/um, and rolling dampers by less than 0.005 %.
MIN_PARTICIPATION, N_COMPARED = 1e-3, 10


def stuck_stiffness(stiffness: Matrix, joints: Iterable[Joint]) -> Matrix:
    """Stiffness with all sliders stuck and all contacts closed, shape (r, r) [N/m].

    Parameters
    ----------
    stiffness
        Stiffness of the structure without its joints, shape (r, r) [N/m].
    joints
        Joints of the structure; joints without a stuck stiffness add nothing.

    Raises
    ------
    JointError
        A joint whose stiffness overflows.
    """
    stuck = np.array(stiffness)
    for joint in joints:
        with np.errstate(over="ignore", invalid="ignore"):
            for row, spring in zip(joint.directions, joint.stuck_stiffness, strict=True):
                stuck += spring * np.outer(row, row)
        if not np.isfinite(stuck).all():
            raise JointError(
                f'the joint "{joint.name}" is too stiff for double precision: give smaller weights of its directions, '
                "or a smaller stiffness"
            )
    return stuck


def stick_at_rest(stiffness: Matrix, joints: Iterable[Joint]) -> Matrix:
    """Stiffness with all sliders stuck, without contacts that are open at rest, shape (r, r) [N/m]."""
    return stuck_stiffness(stiffness, [joint for joint in joints if not joint.open_at_rest])


def stuck_damping(
    mass: Matrix, stiffness: Matrix, stuck: Matrix, ratio: float, seen: Real | Array | None = None
) -> Matrix:
    r"""Rayleigh damping with a given ratio of the first elastic mode of the stuck structure, shape (r, r) [N s/m].

    C = alpha M + beta K. K is the stiffness without contact springs, so that the damping does not change when contacts
    slide or open; the part of the mode's damping that would belong to the contact springs is added to the mass,

    .. math:: \alpha = \zeta \omega (2 - s), \quad \beta = \zeta / \omega, \quad
              s = \varphi^T K \varphi / \omega^2, \quad \varphi^T M \varphi = 1 .

    Without contacts, mass and stiffness contribute half each; if only contacts hold the body in this mode, all damping
    comes from the mass.

    Parameters
    ----------
    mass, stiffness
        Matrices without contacts, shape (r, r) [kg, N/m].
    stuck
        Stiffness with contacts, see `stuck_stiffness`, shape (r, r) [N/m].
    ratio
        Damping ratio zeta [-].
    seen
        One or several rows, such as the coefficients of the force, shape (r,) or (n, r): the mode is the first that
        moves along them. A damper that rolls about its contact line has a lower frequency than the blade, but no force
        on the blade excites it. The first elastic mode by default.

    Raises
    ------
    InputError
        A ratio outside [0, 1).
    JointError
        No elastic mode.
    """
    modes = compute_dense_modes(mass, stuck)
    elastic = np.flatnonzero(1 - modes.shift * modes.mu > RIGID)[:N_COMPARED]
    if not len(elastic):
        raise JointError("with all contacts stuck no mode is elastic, so no damping ratio can be assigned")
    shapes = modes.mode_shapes
    along = np.ones(len(elastic)) if seen is None else np.linalg.norm(np.atleast_2d(seen) @ shapes[:, elastic], axis=0)
    first = int(elastic[np.argmax(along >= MIN_PARTICIPATION * along.max())])
    omega = float(np.sqrt(modes.lambda_[first]))
    damping = rayleigh_damping(ratio, omega / (2 * pi))
    shape = shapes[:, first]
    own = float(shape @ stiffness @ shape) / omega**2
    return np.asarray(damping.mass_factor * (2 - own) * mass + damping.stiffness_factor * stiffness)
