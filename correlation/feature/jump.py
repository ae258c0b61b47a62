r"""Jumps of a measured curve: steps to another steady state, far larger than the neighbouring steps.

Near a resonance the response X changes rapidly and its inverse 1 / X does not; at an antiresonance the reverse is true.
A step is a jump if both change by far more than in the neighbouring steps. Steps over a gap between two measured bands
do not count.
"""

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.feature.gap import find_gaps

Curve = Complex[NDArray[np.complex128], " n"]
Steps = Float[NDArray[np.float64], " s"]

#: Least ratio of a jump to the median of neighbouring steps, and number of these steps.
JUMP, NEIGHBOURS = 4.0, 8
#: Least change of a jump relative to the larger value [-], and least number of points of a curve.
MIN_JUMP, MIN_POINTS = 0.1, 6
#: Largest step that noise explains [standard deviations].
MAX_NOISE_STEP = 5.0


def find_curve_jumps(
    frequency: Float[NDArray[np.float64], " n"], value: Curve, noise: Float[NDArray[np.float64], " n"] | None = None
) -> Int[NDArray[np.int64], " j"]:
    """Steps of one curve that are jumps: from point i to point i + 1.

    Parameters
    ----------
    frequency
        Frequencies, ascending, shape (n,) [Hz].
    value
        Values, shape (n,); NaN where there is none.
    noise
        Standard deviation of each value, shape (n,); zero by default.
    """
    there = np.flatnonzero(np.isfinite(value) & (np.abs(value) > 0))
    bands = np.split(there, find_gaps(frequency[there]) + 1)
    return np.concatenate([_find_in_band(band, value, noise) for band in bands])


def _find_in_band(
    there: Int[NDArray[np.int64], " b"], value: Curve, noise: Float[NDArray[np.float64], " n"] | None
) -> Int[NDArray[np.int64], " j"]:
    """Jumps among the points with these indices."""
    if len(there) < MIN_POINTS:
        return np.zeros(0, dtype=np.int64)
    x = value[there]
    step, inverse = np.abs(np.diff(x)), np.abs(np.diff(1 / x))
    larger = np.maximum(np.abs(x[1:]), np.abs(x[:-1]))
    result = _stand_out(step) & _stand_out(inverse) & (step > MIN_JUMP * larger)
    if noise is not None:
        scatter = np.nan_to_num(noise[there])
        result &= step > MAX_NOISE_STEP * np.hypot(scatter[1:], scatter[:-1])
    # A single outlier causes two opposite steps.
    back = np.abs(x[2:] - x[:-2]) < 0.5 * np.minimum(step[1:], step[:-1])
    result[1:] &= ~back
    result[:-1] &= ~back
    return np.asarray(there[np.flatnonzero(result)])


def _stand_out(step: Steps) -> Bool[NDArray[np.bool_], " s"]:
    n = len(step)
    width = min(NEIGHBOURS + 1, n)
    first = np.clip(np.arange(n) - NEIGHBOURS // 2, 0, n - width)
    around = first[:, None] + np.arange(width)
    beside = around[around != np.arange(n)[:, None]].reshape(n, width - 1)
    return np.asarray(step > JUMP * np.median(step[beside], axis=1))
