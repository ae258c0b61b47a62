"""States that a model misses by far more than those beside them: they count less.

Where contacts begin to slip, the state that a sweep leaves behind depends on how the motion settled at each step, which
no steady solution knows. A missing effect shows at many states next to each other; a single one tells of such a place.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import chdtri

from correlation.feature.vector import FeatureVector

Vector = Float[NDArray[np.float64], " m"]

#: Mean square of a state's whitened residuals, as a multiple of what is usual of so many states beside it: at least
#: this, and what chance makes of its few numbers with this probability.
MUCH, NEIGHBOURS, CHANCE = 2.0, 6, 0.005
#: Least mean square that is usual: a model may happen to fit better than noise.
MIN_MEAN_SQUARE = 0.5


def weigh_outliers(features: FeatureVector, residual: Vector) -> Vector:
    """By how much to enlarge the standard deviation of each number, 1 for most, shape (m,).

    Parameters
    ----------
    features
        Features of the points.
    residual
        Whitened, shape (m,).
    """
    state, points = features.state, features.points
    _, first = np.unique(state, return_index=True)
    count = np.bincount(state)
    size = np.bincount(state, residual**2) / count
    much = np.maximum(chdtri(count, CHANCE) / count, MUCH)
    # Of few squares the median is less than the mean.
    whole = size * count / chdtri(count, 0.5)
    factor, rows = np.ones(len(size)), features.row[first]
    sweep = np.column_stack([points.free[rows], points.level[rows]])
    for item in np.unique(sweep, axis=0):
        # Numbers of states rise with the frequency.
        states = np.flatnonzero((sweep == item).all(axis=1))
        if len(states) <= NEIGHBOURS:
            continue
        for place, number in enumerate(states):
            begin = int(np.clip(place - NEIGHBOURS // 2, 0, len(states) - NEIGHBOURS - 1))
            beside = [other for other in states[begin : begin + NEIGHBOURS + 1] if other != number]
            usual = max(float(np.median(whole[beside])), MIN_MEAN_SQUARE)
            if size[number] > much[number] * usual:
                factor[number] = np.sqrt(size[number] / usual)
    return np.asarray(factor[state])
