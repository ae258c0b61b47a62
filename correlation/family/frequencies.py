"""Frequencies at which limits are searched: measured ones, thinned out if too many, supplemented if too few."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import SAME_FREQUENCY
from correlation.family.family import Family, number_points

#: Largest number of different frequency sequences of curves; those with the longest steps drag sliders furthest.
MOST_WAYS = 3
Values = Float[NDArray[np.float64], " f"]


def choose_frequencies(families: Sequence[Family], most: int, fewest: int) -> Values:
    """Frequencies for the limits of some families, ascending [Hz].

    Measured frequencies are chosen. If there are too many, those between whose neighbours the curves change least are
    left out, by the logarithm of the amplitudes or by the share of the band. If there are fewer than `fewest`, others
    are inserted where the curves change most: the search follows limits along the resonance, and misses them if it
    steps over it.

    Parameters
    ----------
    families
        At least one family; amplitudes of motions show the resonances best.
    most, fewest
        Largest and smallest number of frequencies [-].
    """
    measured = _average_frequencies(families)
    if len(measured) == 1:
        return measured
    length = np.diff(measured) / (measured[-1] - measured[0])
    for family in families:
        for curve in family.curves:
            rising = np.concatenate([[True], np.diff(curve.frequency) > 0])
            size = np.log(np.maximum(np.abs(curve.value[rising]), 1e-3 * np.abs(curve.value).max(initial=1e-300)))
            along = np.interp(measured, curve.frequency[rising], np.cumsum(np.abs(np.diff(size, prepend=size[0]))))
            length = np.maximum(length, np.diff(along))
    while len(measured) > max(most, 2):
        # Remove the frequency between whose neighbours the curves change least.
        place = int(np.argmin(length[:-1] + length[1:]))
        measured, length[place + 1] = np.delete(measured, place + 1), length[place] + length[place + 1]
        length = np.delete(length, place)
    parts = np.ones(len(length), dtype=np.int64)
    while parts.sum() + 1 < fewest:
        parts[np.argmax(length / parts)] += 1
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(measured[:-1], measured[1:], parts, strict=True)]
    return np.concatenate([*pieces, measured[-1:]])


def find_stops(families: Sequence[Family], frequency: Values) -> tuple[tuple[int, ...], ...]:
    """Indices in `frequency` of the frequencies of each curve, ascending; sequences with the longest steps first.

    Parameters
    ----------
    families
        Measured families.
    frequency
        Frequencies from `choose_frequencies` [Hz].
    """
    between = (frequency[1:] + frequency[:-1]) / 2
    ways = {
        tuple(np.unique(np.searchsorted(between, curve.frequency)).tolist())
        for family in families
        for curve in family.curves
    }
    return tuple(sorted(ways, key=lambda way: (len(way), way))[:MOST_WAYS])


def _average_frequencies(families: Sequence[Family]) -> Values:
    """Mean frequencies of the measured points; those of several levels are merged if they differ as repeats do."""
    result: list[float] = []
    apart = 0.0
    for family in families:
        point = number_points(family.curves)
        count, total = np.bincount(point), np.bincount(point, family.frequency)
        mean = total / np.maximum(count, 1)
        apart = max(apart, float(np.abs(family.frequency - mean[point]).max(initial=0.0)))
        result += mean[count > 0].tolist()
    rising = np.sort(result)
    groups = np.split(rising, np.flatnonzero(np.diff(rising) > np.maximum(apart, SAME_FREQUENCY * rising[1:])) + 1)
    return np.array([float(group.mean()) for group in groups])
