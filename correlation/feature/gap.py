"""Gaps of a measured curve: steps in frequency that no band was measured in."""

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

#: A step so many times as large as those beside it is none of a grid, however that is refined around a peak [-].
GAP = 5.0
#: Steps on either side that it is compared with: of readings in pairs, as of both sweeps, every other step is tiny [-].
BESIDE = 2


def find_gaps(frequency: Float[NDArray[np.float64], " f"]) -> Int[NDArray[np.int64], " g"]:
    """Steps over a gap, from point i to point i + 1: far larger than those beside them.

    Parameters
    ----------
    frequency
        Ascending, shape (f,) [any unit].
    """
    step = np.diff(frequency)
    if len(step) < 2:
        return np.zeros(0, dtype=np.int64)
    near = np.concatenate([np.zeros(BESIDE), step, np.zeros(BESIDE)])
    away = [BESIDE + shift for shift in range(-BESIDE, BESIDE + 1) if shift]
    beside = np.max([near[first : first + len(step)] for first in away], axis=0)
    return np.flatnonzero(step > GAP * beside)
