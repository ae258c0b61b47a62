"""A limit improved from a state near it."""

import numpy as np
from numpy.typing import NDArray

from hbsolve.limits.local_search import LimitSide, local_search
from hbsolve.limits.optimum import Best, offer
from hbsolve.limits.point import LimitPoint, Sliders


def improve(
    point: LimitPoint,
    best: Best,
    at: int,
    side: LimitSide,
    x: NDArray[np.float64],
    w: Sliders,
    *,
    repaired: bool = False,
) -> float:
    """Settle a state, search from it and take what is better; returns the gain, relative to what was there.

    Parameters
    ----------
    point
        The frequency and level.
    best
        The limits so far, changed in place.
    at, side
        Which of them.
    x, w
        Where to settle from: motion and sliders.
    repaired
        Whether the state comes from an audit.
    """
    settled = point.settle(x, w)
    return offer(best, at, side, settled and local_search(point, settled, side), repaired=repaired)
