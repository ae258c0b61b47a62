r"""Where a rigid body that nothing but contact holds lies before its load presses it: seated against uneven gaps.

A gap field is reckoned from where the drawing has the body. Before any spring of a contact is stretched the body lies
elsewhere, without friction and as far as its load can move it,

.. math:: \max_a\; f \cdot R a \quad \text{subject to} \quad s = g - N R a \ge 0 ,

R being its rigid motions. Of several such places it is that of the least \|s\|. What is left, s, are the gaps from
there; contacts have no tension there. A rigid motion r adds N r to g and r to the place, and changes s by nothing.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import scipy.optimize
from jaxtyping import Float
from numpy.typing import NDArray

from reduction.errors import JointError
from reduction.joined import Joined

Real = NDArray[np.float64]
Row = Float[Real, " r"]

#: Singular value of the approaches, over the largest, below which a motion opens and closes nothing.
IDLE = 1e-9
#: How much more the load counts than \|s\|, as a length over the largest gap.
LOADED = 1e3
#: Share of the load that may stay without a contact to carry it.
CARRIED = 1e-6


def seated(bodies: Joined, motions: Mapping[str, Float[Real, "r 6"]], pull: Row) -> Joined:
    """Contacts with the gaps that are left where each body is seated.

    Parameters
    ----------
    bodies
        Unloaded.
    motions
        Rigid motions of each body that contact alone holds, by name; contacts that none of them moves stay as they are.
    pull
        The static load, shape (r,) [N].

    Raises
    ------
    JointError
        A load that pulls a body out of its contacts.
    """
    gaps = np.array([each.gap for each in bodies.contacts])
    normals = np.array([each.normal for each in bodies.contacts]).reshape(-1, len(pull))
    for body, motion in motions.items():
        approach = normals @ motion
        held = np.abs(approach).max(axis=1, initial=0.0) > 0
        gaps[held] = seated_gaps(approach[held], gaps[held], pull @ motion, body)
    contacts = tuple(replace(each, gap=float(gap)) for each, gap in zip(bodies.contacts, gaps, strict=True))
    return replace(bodies, contacts=contacts)


def seated_gaps(approach: Float[Real, "c m"], gaps: Float[Real, " c"], load: Float[Real, " m"], body: str) -> Real:
    """The gaps s that are left, shape (c,) [m].

    Parameters
    ----------
    approach
        How unit motions close each contact, N R.
    gaps
        g [m].
    load
        On the motions, f R.
    body
        Its name, for the message.

    Raises
    ------
    JointError
        The load pulls the body out of its contacts.
    """
    if not gaps.any():
        return gaps
    scale = np.abs(approach).max(axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    U, sigma, Vt = np.linalg.svd(approach / scale, full_matrices=False)
    kept = sigma > IDLE * sigma[0]
    U = U[:, kept]
    # With y = S V^T a the load does the work h.y, and motions that close nothing have no part in it.
    h = (Vt[kept] @ (load / scale)) / sigma[kept]
    pressed, missed = scipy.optimize.nnls(U.T, h)
    if missed > CARRIED * float(np.linalg.norm(h)):
        raise JointError(
            f"{body} finds no seat: its load pulls it out of its contacts; check the direction of the load"
        )
    size = float(np.abs(gaps).max())
    # min |s|^2 - 2 c h.y is the point of U y <= g that is nearest to y_0 (Lawson and Hanson, chapter 23: LDP by NNLS).
    y0 = U.T @ gaps + LOADED * size / max(float(np.abs(pressed).max()), np.finfo(float).tiny) * h
    bound = (U @ y0 - gaps) / size
    E = np.vstack([-U.T, bound])
    target = np.zeros(len(E))
    target[-1] = 1.0
    z, _ = scipy.optimize.nnls(E, target)
    r = E @ z - target
    y = y0 - size * r[:-1] / r[-1] if bound.max() > 0 else y0
    left = gaps - U @ y
    return np.asarray(np.where(left < 1e-9 * size, 0.0, left))
