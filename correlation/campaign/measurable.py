"""Range of magnitudes that readings can have.

The prefixes of SI go from quecto, 1e-30, to quetta, 1e30 (27th CGPM, 2022, resolution 3): all measured values lie
between them in their SI unit. A damaged byte in an exponent leads far beyond, to 1e-308 or 1e308.
"""

import numpy as np
from jaxtyping import Bool
from numpy.typing import NDArray

#: Smallest and largest magnitude of a reading other than zero [unit of the reading].
MIN_READING, MAX_READING = 1e-30, 1e30
REMEDY = (
    f"readings do not have that size ({MIN_READING:g} to {MAX_READING:g}): is the file damaged? Export it again, "
    "or leave the row out"
)


def is_beyond(values: NDArray[np.float64] | NDArray[np.complex128]) -> Bool[NDArray[np.bool_], " n"]:
    """Mask of levels, forces or frequencies outside the range of readings, shape (n,)."""
    size = np.abs(values)
    return np.asarray(size > MAX_READING) | (np.asarray(size < MIN_READING) & (size > 0))


def is_too_large(values: NDArray[np.float64] | NDArray[np.complex128]) -> Bool[NDArray[np.bool_], " n"]:
    """Mask of responses above the range of readings, shape (n,); a response has no lower bound."""
    return np.asarray(np.abs(values) > MAX_READING)
