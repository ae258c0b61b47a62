r"""Peaks over frequency of the response at one level, all motions together.

The size of a response is :math:`\sqrt{\sum_s |X_s|^2}` over the sensors s, each in units of its largest value. At a
peak, the size falls on either side to a third of the power or less before it rises to a higher peak. The points from
which frequency and damping of one mode are read (`metric.response.find_peak`) then belong to this peak alone. Bands
that were measured separately are searched separately.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.feature.gap import find_gaps
from correlation.noise.smoothness import estimate_curve_noise

Frequencies = Float[NDArray[np.float64], " f"]

#: Largest power in the valley between two peaks, over that of the lower peak [-].
VALLEY = 1 / 3
#: Least height of a peak above its valleys [standard deviations].
STANDS_OUT = 3.0


@dataclass(frozen=True, kw_only=True, eq=False)
class CurvePeak:
    """A peak at one level.

    Parameters
    ----------
    frequency
        Frequency of the highest point [Hz].
    low, high
        Frequencies of the valleys on both sides, or of the ends of the measured band [Hz].
    shape
        Motions at the highest point, shape (s,) [largest of each sensor]; NaN where a sensor was not read.
    """

    frequency: float
    low: float
    high: float
    shape: Complex[NDArray[np.complex128], " s"]


def find_curve_peaks(
    frequency: Frequencies,
    motion: Complex[NDArray[np.complex128], "s f"],
    deviation: Float[NDArray[np.float64], "s f"] | None = None,
) -> tuple[CurvePeak, ...]:
    """Peaks in ascending frequency.

    Parameters
    ----------
    frequency
        Frequencies, ascending, shape (f,) [Hz].
    motion
        Motions of s sensors, scaled to similar size, shape (s, f); NaN where there is no reading.
    deviation
        Standard deviation of their moduli, shape (s, f); zero by default.
    """
    power = np.nansum(np.abs(motion) ** 2, axis=0)
    size = np.sqrt(power)
    if deviation is None:
        noise = np.zeros(len(frequency))
    else:
        noise = np.sqrt(np.nansum((np.abs(motion) * deviation) ** 2, axis=0)) / np.maximum(size, np.finfo(float).tiny)
    result: list[CurvePeak] = []
    for piece in np.split(np.arange(len(frequency)), find_gaps(frequency) + 1):
        tops = [top for top in piece[1:-1] if _is_peak(size[piece], noise[piece], int(top - piece[0]))]
        ends = [
            int(piece[0]),
            *(int(left + np.argmin(size[left : right + 1])) for left, right in pairwise(tops)),
            int(piece[-1]),
        ] if len(piece) else []  # fmt: skip
        result += [
            CurvePeak(
                frequency=float(frequency[top]), low=float(frequency[low]), high=float(frequency[high]),
                shape=motion[:, top],
            )
            for top, (low, high) in zip(tops, pairwise(ends), strict=False)
        ]  # fmt: skip
    return tuple(result)


def find_own_peaks(
    frequency: Frequencies, value: Complex[NDArray[np.complex128], " f"] | Frequencies
) -> tuple[CurvePeak, ...]:
    """Peaks in ascending frequency of a single curve; its noise is estimated from its roughness (`noise.smoothness`).

    Parameters
    ----------
    frequency
        Frequencies, ascending, shape (f,) [Hz].
    value
        Complex amplitudes, or moduli, shape (f,).
    """
    parts = 2 if np.iscomplexobj(value) else 1
    curve = np.asarray(value, dtype=np.complex128)
    deviation, _ = estimate_curve_noise(frequency, curve, parts=parts)
    return find_curve_peaks(frequency, curve[None], np.nan_to_num(deviation)[None])


def _is_peak(size: Frequencies, noise: Frequencies, top: int) -> bool:
    """Whether a point is the highest between two valleys, or between a valley and an end."""
    for beside in (np.arange(top - 1, -1, -1), np.arange(top + 1, len(size))):
        # Of two equal points the first is the peak.
        higher = size[beside] > size[top] if beside[0] > top else size[beside] >= size[top]
        end = int(np.argmax(higher)) if higher.any() else len(beside)
        if not end:
            return False
        valley = beside[np.argmin(size[beside[:end]])]
        if size[top] - size[valley] <= STANDS_OUT * np.hypot(noise[top], noise[valley]):
            return False
        if higher.any() and size[valley] ** 2 > VALLEY * size[top] ** 2:
            return False
    return True
