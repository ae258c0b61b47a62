"""The tasks of `benchmarks.scale_out`: in a file of their own, which other processes can import by its name."""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Model:
    """What all tasks need."""

    matrix: NDArray[np.float64]


def wait_a_second(model: Model, number: int) -> float:
    """One task."""
    time.sleep(1.0)
    return float(model.matrix[0, 0]) + number
