r"""Frequency offsets of set-ups and of a model: one number for all readings that share it, not one per reading.

A set-up whose frequency is off by a share d, and a model whose frequencies are off by m, compare readings at f with
limits at f (1 + m + d). An error of the frequency moves a whole curve along its axis: it may bring one flank of a
resonance to a limit only as it takes the other one away, and it hardly changes a peak. Taken as a tolerance of each
reading by itself it would allow at both flanks, and at all levels, what it can allow at one; near a resonance that is,
relative to the amplitude, 1 / (2 zeta) times as large. The offsets are therefore estimated, from all families at once,
as those that leave least outside:

.. math:: \min_{m, d_r} \; \sum_r \sum_j \frac{o_j(m + d_r)^2}{\sigma_j^2} + \frac{m^2}{\sigma_m^2}
          + \sum_r \frac{d_r^2}{\sigma_d^2}, \qquad |m| \le 3 \sigma_m, \; |d_r| \le 3 \sigma_d ,

with o the distance of a reading outside of its limits, 0 inside, and sigma its noise. What is outside then is outside
for every frequency that the set-ups may have.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.family.band import PredictedBand
from correlation.family.family import Family
from correlation.family.noise import ReadingNoise

#: A test and its repeat.
SetUp = tuple[str, int]
#: Largest offset in standard deviations, as far as a reading may be outside for its noise, and steps of the search in
#: one of them.
FURTHEST, FINE = 3.0, 4


def estimate_frequency_offsets(
    families: Sequence[Family],
    bands: Sequence[PredictedBand],
    noise: Sequence[ReadingNoise],
    *,
    set_up: float,
    model: float,
) -> Mapping[SetUp, float]:
    """Offsets that leave least outside, the model's included, by set-up [-].

    Parameters
    ----------
    families, bands, noise
        Families, and band and noise of each.
    set_up, model
        Standard deviations of the frequency from one set-up to another and of the model, relative [-].
    """
    keys = list(dict.fromkeys((curve.test, curve.repeat) for family in families for curve in family.curves))
    own, common = _grid(set_up), _grid(model)
    if len(own) == len(common) == 1:
        return dict.fromkeys(keys, 0.0)
    best = np.inf
    result: Mapping[SetUp, float] = {}
    # Offsets that the sums of both reach: each costs one look at all bands.
    known: dict[float, dict[SetUp, float]] = {}
    for m in common:
        total, chosen = _penalty(m, model), {}
        for d in own:
            if m + d not in known:
                known[m + d] = _outside(families, bands, noise, m + d)
        for key in keys:
            costs = [known[m + d].get(key, 0.0) + _penalty(d, set_up) for d in own]
            least = int(np.argmin(costs))
            total += costs[least]
            chosen[key] = float(m + own[least])
        if total < best:
            best, result = total, chosen
    return result


def _grid(deviation: float) -> Float[NDArray[np.float64], " n"]:
    """Offsets that are tried, the smallest first so that of equal ones it is taken [-]."""
    if not deviation:
        return np.zeros(1)
    steps = np.arange(-FURTHEST * FINE, FURTHEST * FINE + 1) * (deviation / FINE)
    return steps[np.argsort(np.abs(steps), kind="stable")]


def _penalty(offset: float, deviation: float) -> float:
    return (offset / deviation) ** 2 if deviation else 0.0


def _outside(
    families: Sequence[Family], bands: Sequence[PredictedBand], noise: Sequence[ReadingNoise], offset: float
) -> dict[SetUp, float]:
    """Squares of the distances outside, in standard deviations, by set-up [-]."""
    result: dict[SetUp, float] = {}
    for family, band, own in zip(families, bands, noise, strict=True):
        at = band.at(family.frequency, offset=offset)
        deviation = np.hypot(at.deviation, own.deviation(at.value))
        beyond = np.maximum(at.value[0] - family.value, family.value - at.value[1])
        side = (family.value > at.value[1]).astype(int)
        sigma = np.maximum(deviation[side, np.arange(len(side))], np.finfo(float).tiny)
        square = np.where(np.nan_to_num(beyond, nan=0.0) > 0, (beyond / sigma) ** 2, 0.0)
        sums = np.bincount(family.curve_number, square, minlength=len(family.curves))
        for curve, value in zip(family.curves, sums, strict=True):
            key = curve.test, curve.repeat
            result[key] = result.get(key, 0.0) + float(value)
    return result
