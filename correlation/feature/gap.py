"""Gaps of a measured curve: frequency steps between separately measured bands."""

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

#: Ratio to the neighbouring steps above which a step is a gap; the refinement of a grid around a peak is less [-].
GAP = 5.0
#: Number of neighbouring steps on either side; with pairs of readings, as from both sweeps, every other step is tiny
#: [-].
BESIDE = 2


def find_gaps(frequency: Float[NDArray[np.float64], " f"]) -> Int[NDArray[np.int64], " g"]:
    """Steps over a gap, from point i to point i + 1: far larger than their neighbours.

    Parameters
    ----------
    frequency
        Frequencies, ascending, shape (f,) [any unit].
    """
    step = np.diff(frequency)
    if len(step) < 2:
        return np.zeros(0, dtype=np.int64)
    near = np.concatenate([np.zeros(BESIDE), step, np.zeros(BESIDE)])
    away = [BESIDE + shift for shift in range(-BESIDE, BESIDE + 1) if shift]
    beside = np.max([near[first : first + len(step)] for first in away], axis=0)
    return np.flatnonzero(step > GAP * beside)
