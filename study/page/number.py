"""Numbers in the data of a page: few digits, and None for values that are not finite."""

from collections.abc import Sequence
from math import isfinite

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Numbers = Float[NDArray[np.float64], " n"]


def round_list(values: Numbers | Sequence[float], digits: int = 5) -> list[float | None]:
    """Numbers rounded to a number of significant digits; None for those that are not finite."""
    shown = f"%.{digits}g"
    return [float(shown % value) if isfinite(value) else None for value in np.asarray(values).tolist()]


def bin_image(image: Float[NDArray[np.float64], "r f"], steps: Sequence[float]) -> list[list[int | None]]:
    """Index of the step of a scale that contains each value; None for values that are not finite."""
    step = np.searchsorted(steps[1:], np.nan_to_num(image), side="right")
    return [
        [int(number) if np.isfinite(value) else None for number, value in zip(*both, strict=True)]
        for both in zip(step, image, strict=True)
    ]
