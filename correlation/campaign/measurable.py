"""Range of sizes that readings can have.

The prefixes of SI go from quecto, 1e-30, to quetta, 1e30 (27th CGPM, 2022, resolution 3): what was ever measured lies
between them in its SI unit. A damaged byte in an exponent leads far beyond, to 1e-308 or 1e308.
"""

import numpy as np
from jaxtyping import Bool
from numpy.typing import NDArray

#: Least and greatest size of a reading that is not zero [its unit].
MIN_READING, MAX_READING = 1e-30, 1e30
REMEDY = (
    f"readings do not have that size ({MIN_READING:g} to {MAX_READING:g}): is the file damaged? Export it again, "
    "or leave the row out"
)


def is_beyond(values: NDArray[np.float64] | NDArray[np.complex128]) -> Bool[NDArray[np.bool_], " n"]:
    """Mask of values outside the range of an excitation: of a level, a force or a frequency, shape (n,)."""
    size = np.abs(values)
    return np.asarray(size > MAX_READING) | (np.asarray(size < MIN_READING) & (size > 0))


def is_too_large(values: NDArray[np.float64] | NDArray[np.complex128]) -> Bool[NDArray[np.bool_], " n"]:
    """Mask of values too large for a response, which has no lower bound, shape (n,)."""
    return np.asarray(np.abs(values) > MAX_READING)
