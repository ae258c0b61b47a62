"""Tasks of `benchmarks.scale_out`, in a separate module that other processes can import."""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Model:
    """Data shared by all tasks."""

    matrix: NDArray[np.float64]


def wait_a_second(model: Model, number: int) -> float:
    """Wait a second; returns a number that depends on the model."""
    time.sleep(1.0)
    return float(model.matrix[0, 0]) + number
