"""A sampled force between its samples: band-limited, as an analyser with an anti-aliasing filter records it."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.signal import upfirdn

#: Samples on either side that the interpolating kernel reaches, and the parameter of its Kaiser window: amplitudes up
#: to 0.9 of half the sampling rate are right to 1e-4.
REACH, WINDOW = 40, 8.0


def refine(values: Float[NDArray[np.float64], " n"], factor: int) -> Float[NDArray[np.float64], " t"]:
    """Values at `factor` times the rate, from the first sample to the last; the samples themselves stay.

    Parameters
    ----------
    values
        Shape (n,); before its start and behind its end the first and last are taken to stay, which costs accuracy
        within `REACH` samples of there.
    factor
        Whole number [-].
    """
    place = np.arange(-REACH * factor, REACH * factor + 1) / factor
    kernel = np.sinc(place) * np.kaiser(len(place), WINDOW)
    padded = np.concatenate([np.full(REACH, values[0]), values, np.full(REACH, values[-1])])
    fine = upfirdn(kernel, padded - values[0], factor) + values[0]
    start = 2 * REACH * factor
    return np.array(fine[start : start + (len(values) - 1) * factor + 1], dtype=np.float64)


def straighten(fine: Float[NDArray[np.float64], " t"]) -> Float[NDArray[np.float64], " t"]:
    r"""Values such that straight lines between them act as a smooth curve through `fine` does, shape (t,).

    Lines through a sine of :math:`\omega h` an instant have :math:`1 - (\omega h)^2 / 12` of its amplitude; the second
    difference puts that back, and leaves an error of fourth order.
    """
    corrected = np.array(fine, dtype=np.float64)
    corrected[1:-1] -= np.diff(fine, 2) / 12
    return corrected
