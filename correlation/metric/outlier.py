"""Weights of outliers: states with a far larger error than their neighbours have less weight.

At the onset of slip the state after a step of a sweep depends on the transient, which steady solutions do not contain.
A missing effect affects many neighbouring states; a single outlier indicates such a transient.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import chdtri

from correlation.feature.vector import FeatureVector

Vector = Float[NDArray[np.float64], " m"]

#: An outlier has a mean square of its whitened residuals, relative to that of this many neighbouring states, above this
#: multiple and above the upper chi-square quantile with this probability.
MUCH, NEIGHBOURS, CHANCE = 2.0, 6, 0.005
#: Lower limit of the mean square of the neighbours: a model may fit better than noise by chance.
MIN_MEAN_SQUARE = 0.5


def weigh_outliers(features: FeatureVector, residual: Vector) -> Vector:
    """Factor on the standard deviation of each number, 1 for most, shape (m,).

    Parameters
    ----------
    features
        Features of the points.
    residual
        Whitened residual, shape (m,).
    """
    state, points = features.state, features.points
    _, first = np.unique(state, return_index=True)
    count = np.bincount(state)
    size = np.bincount(state, residual**2) / count
    much = np.maximum(chdtri(count, CHANCE) / count, MUCH)
    # The median of the mean of few squares is below its expectation.
    whole = size * count / chdtri(count, 0.5)
    factor, rows = np.ones(len(size)), features.row[first]
    sweep = np.column_stack([points.free[rows], points.level[rows]])
    for item in np.unique(sweep, axis=0):
        # Indices of states are in order of frequency.
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
