"""Joints as arrays: what the balance and the integration in time both need."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def starts(counts: Sequence[int]) -> NDArray[np.int64]:
    """First number of each of some groups and, last, how many there are in all, shape (n + 1,)."""
    return np.concatenate([[0], np.cumsum(np.array(counts, dtype=np.int64))]).astype(np.int64)
