r"""Position of a rigid body that is supported by contact only, settled against uneven gaps before it is loaded.

Gaps are measured from the nominal position of the body. Before any contact spring is deformed, the body settles as deep
in its grooves as possible,

.. math:: \min_a\; \sum_i s_i \quad \text{subject to} \quad s = g - N R a \ge 0 ,

with its rigid motions R; of several solutions, the one with the smallest \|s\| is taken. The remaining gaps s are
measured from this position, in which no contact is in tension. A rigid motion r adds N r to g and r to the position,
and does not change s.

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
from reduction.joined_bodies import JoinedBodies

#: Singular value of the approaches, relative to the largest, below which a motion changes no gap.
IDLE = 1e-9
#: Weight c of the sum of the gaps in the objective \|s\|^2 + 2 c sum(s), relative to the largest gap.
SUM_WEIGHT = 30.0
#: Gap relative to the largest gap below which a contact touches.
ROUND_OFF = 1e-8


def settle_bodies(bodies: JoinedBodies, motions: Mapping[str, Float[Real, "r 6"]]) -> JoinedBodies:
    """Bodies whose contacts have the gaps that remain after settling.

    Parameters
    ----------
    bodies
        Bodies and contacts, unloaded.
    motions
        Rigid motions of each body that is held by contact only, by name, shape (r, 6); contacts that they do not move
        keep their gaps.
    """
    gaps = np.array([item.gap for item in bodies.contacts])
    normals = np.array([item.normal for item in bodies.contacts])
    for motion in motions.values():
        approach = normals @ motion
        is_touched = np.abs(approach).max(axis=1, initial=0.0) > 0
        gaps[is_touched] = compute_remaining_gaps(approach[is_touched], gaps[is_touched])
    contacts = tuple(replace(item, gap=float(gap)) for item, gap in zip(bodies.contacts, gaps, strict=True))
    return replace(bodies, contacts=contacts)


def compute_remaining_gaps(approach: Float[Real, "c m"], gaps: Float[Real, " c"]) -> Real:
    """Remaining gaps s, shape (c,) [m], from gaps g [m] and the approach N R of unit motions, shape (c, m)."""
    if not gaps.any():
        return gaps
    scale = np.abs(approach).max(axis=0)
    U, sigma, _ = np.linalg.svd(approach / np.where(scale > 0, scale, 1.0), full_matrices=False)
    # Motions that change no gap are left out.
    U = U[:, sigma > IDLE * sigma[0]]
    size = float(np.abs(gaps).max())
    # min |s|^2 + 2 c sum(s) over s = g - U y >= 0: the point of U y <= g that is nearest to y_0.
    y0 = U.T @ (gaps + SUM_WEIGHT * size)
    beyond = U @ y0 - gaps
    E = np.vstack([-U.T, beyond / size])
    target = np.zeros(len(E))
    target[-1] = 1.0
    z, _ = scipy.optimize.nnls(E, target)
    r = E @ z - target
    left = gaps - U @ (y0 - size * r[:-1] / r[-1])
    return np.asarray(np.where(left < ROUND_OFF * size, 0.0, left))
