r"""Where a rigid body that nothing but contact holds lies before its load presses it: seated against uneven gaps.

A gap field is reckoned from where the drawing has the body. Before any spring of a contact is stretched the body lies
elsewhere, as deep in its grooves as it goes,

.. math:: \min_a\; \sum_i s_i \quad \text{subject to} \quad s = g - N R a \ge 0 ,

R being its rigid motions; of several such places it is that of the least \|s\|. What is left, s, are the gaps from
there; contacts have no tension there. A rigid motion r adds N r to g and r to the place, and changes s by nothing.

References
----------
Lawson and Hanson, Solving Least Squares Problems, SIAM (1995), chapter 23: LDP by NNLS.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import scipy.optimize
from jaxtyping import Float

from reduction.array_type import Real
from reduction.joined import Joined

#: Singular value of the approaches, over the largest, below which a motion opens and closes nothing.
IDLE = 1e-9
#: How much more the sum of the gaps counts than \|s\|, as a length over the largest gap.
DEEP = 30.0
#: Share of the largest gap below which a contact touches.
ROUND_OFF = 1e-8


def seated(bodies: Joined, motions: Mapping[str, Float[Real, "r 6"]]) -> Joined:
    """Contacts with the gaps that are left where each body is seated.

    Parameters
    ----------
    bodies
        Bodies and contacts, unloaded.
    motions
        Rigid motions of each body that contact alone holds, by name, shape (r, 6); contacts that none of them moves
        stay as they are.
    """
    gaps = np.array([item.gap for item in bodies.contacts])
    normals = np.array([item.normal for item in bodies.contacts])
    for motion in motions.values():
        approach = normals @ motion
        is_touched = np.abs(approach).max(axis=1, initial=0.0) > 0
        gaps[is_touched] = seated_gaps(approach[is_touched], gaps[is_touched])
    contacts = tuple(replace(item, gap=float(gap)) for item, gap in zip(bodies.contacts, gaps, strict=True))
    return replace(bodies, contacts=contacts)


def seated_gaps(approach: Float[Real, "c m"], gaps: Float[Real, " c"]) -> Real:
    """The gaps s that are left, shape (c,) [m], of gaps g [m] that unit motions close by N R, shape (c, m)."""
    if not gaps.any():
        return gaps
    scale = np.abs(approach).max(axis=0)
    U, sigma, _ = np.linalg.svd(approach / np.where(scale > 0, scale, 1.0), full_matrices=False)
    # Motions that close nothing have no part in it.
    U = U[:, sigma > IDLE * sigma[0]]
    size = float(np.abs(gaps).max())
    # min |s|^2 + 2 c sum(s) over s = g - U y >= 0: the point of U y <= g that is nearest to y_0.
    y0 = U.T @ (gaps + DEEP * size)
    beyond = U @ y0 - gaps
    E = np.vstack([-U.T, beyond / size])
    target = np.zeros(len(E))
    target[-1] = 1.0
    z, _ = scipy.optimize.nnls(E, target)
    r = E @ z - target
    left = gaps - U @ (y0 - size * r[:-1] / r[-1])
    return np.asarray(np.where(left < ROUND_OFF * size, 0.0, left))
