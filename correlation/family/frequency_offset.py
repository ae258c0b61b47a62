r"""Frequency offsets of set-ups and of a model: one value common to all their readings, not one per reading.

With relative frequency errors d of a set-up and m of the model, readings at f are compared with limits at
f (1 + m + d). A frequency error shifts a whole curve along its axis: it moves one flank of a resonance towards a limit
and the other one away from it, and hardly changes a peak. A tolerance of each reading would allow the shift at both
flanks, and at all levels; near a resonance the effect relative to the amplitude is 1 / (2 zeta) times the offset. The
offsets are therefore estimated from all families together, such that least is outside:

.. math:: \min_{m, d_r} \; \sum_r \sum_j \min\left(\frac{o_j(m + d_r)^2}{\sigma_j^2}, 9\right)
          + \frac{m^2}{\sigma_m^2} + \sum_r \frac{d_r^2}{\sigma_d^2}, \qquad
          |m| \le 3 \sigma_m, \; |d_r| \le 3 \sigma_d .

with o the distance of a reading outside its limits, 0 inside, and sigma its noise. A reading that remains outside is
outside for every possible frequency of the set-ups. The bound 9 limits readings that no offset explains: without it a
few readings on another branch of states would move all others out of their limits. sigma_m also contains the effect of
contact errors on frequency: an error of 1 % in the stiffness of a contact line shifts a resonance several times as much
as the mesh does.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.family.band import PredictedBand
from correlation.family.correction import SetUp
from correlation.family.family import Family
from correlation.family.noise import ReadingNoise

#: Least number of frequencies of limits for an estimate of a shift; limits below this share of the largest one have
#: less weight [-].
FEWEST_POINTS, SMALL = 4, 0.1
#: Largest offset in standard deviations, equal to the bound of the distance of a reading; steps of the search per
#: smaller standard deviation, and largest number of steps to either side.
FURTHEST, FINE, MOST = 3.0, 4, 150
ROUND_OFF = 1e-9


def estimate_frequency_offsets(
    families: Sequence[Family],
    bands: Sequence[PredictedBand],
    noise: Sequence[ReadingNoise],
    *,
    set_up: float,
    model: float,
) -> Mapping[SetUp, float]:
    """Offsets for which least is outside, including that of the model, by set-up [-].

    Parameters
    ----------
    families, bands, noise
        Families, and band and noise of each.
    set_up, model
        Relative standard deviations of the frequency between set-ups, and of the model [-].
    """
    keys = list(dict.fromkeys(key for family in families for key in family.set_ups))
    if not (set_up or model):
        return dict.fromkeys(keys, 0.0)
    furthest = FURTHEST * (set_up + model)
    step = max(min(item for item in (set_up, model) if item) / FINE, furthest / MOST)
    own, common = (int(FURTHEST * item / step + ROUND_OFF) for item in (set_up, model))
    grid = step * np.arange(-own - common, own + common + 1)
    cost = np.array(
        [
            [look.get(key, 0.0) for key in keys]
            for look in (sum_outside_of_limits(families, bands, noise, o) for o in grid)
        ]
    )
    # Smallest offsets first, so that they are preferred at equal cost.
    moved = sorted(range(-own, own + 1), key=abs)
    price = np.array([compute_penalty(step * item, set_up) for item in moved])[:, None]
    best, result = np.inf, np.zeros(len(keys), dtype=np.int64)
    for m in sorted(range(-common, common + 1), key=abs):
        costs = cost[np.array(moved) + m + own + common] + price
        total = float(costs.min(axis=0).sum()) + compute_penalty(step * m, model)
        if total < best:
            best, result = total, np.array(moved)[costs.argmin(axis=0)] + m
    return {key: float(step * number) for key, number in zip(keys, result, strict=True)}


def split_frequency_part(
    changes: Float[NDArray[np.float64], "k 2 f"],
    limits: Float[NDArray[np.float64], "2 f"],
    slope: Float[NDArray[np.float64], "2 f"],
) -> tuple[Float[NDArray[np.float64], " k"], Float[NDArray[np.float64], "k 2 f"]]:
    r"""Split changes of both limits into a relative frequency shift [-] and a remainder.

    With the slopes :math:`s = f\,dL/df` of the limits L, the relative shift of a change c is

    .. math:: a = \frac{\sum w c s}{\sum w s^2}, \qquad w = \frac{1}{L^2 + (L_{max} / 10)^2} .

    Parameters
    ----------
    changes
        Changes of the limits, shape (k, 2, f).
    limits, slope
        Limits and their slopes, NaN where there are none, shape (2, f). With few frequencies the shift is zero: it
        would absorb any change.
    """
    known = np.isfinite(limits) & np.isfinite(slope)
    if known.sum(axis=1).max() < FEWEST_POINTS:
        return np.zeros(len(changes)), changes
    limit, own = np.where(known, limits, 0.0), np.where(known, slope, 0.0)
    weight = known / (limit**2 + (SMALL * np.abs(limit).max()) ** 2)
    size = float(np.sum(weight * own**2))
    shift = np.sum(changes * own * weight, axis=(1, 2)) / size if size else np.zeros(len(changes))
    return shift, changes - shift[:, None, None] * own


def compute_penalty(offset: float, deviation: float) -> float:
    """Cost of an offset [-]."""
    return (offset / deviation) ** 2 if deviation else 0.0


def sum_outside_of_limits(
    families: Sequence[Family],
    bands: Sequence[PredictedBand],
    noise: Sequence[ReadingNoise],
    offset: float | Mapping[SetUp, float],
) -> dict[SetUp, float]:
    """Sum of bounded squared distances outside, in standard deviations, by set-up [-].

    Parameters
    ----------
    families, bands, noise
        Families, and band and noise of each.
    offset
        Relative frequency offset, one for all or by set-up [-].
    """
    result: dict[SetUp, float] = {}
    for family, band, own in zip(families, bands, noise, strict=True):
        known = np.array([offset[key] if isinstance(offset, Mapping) else offset for key in family.set_ups])
        at = band.at(family.frequency, offset=known[family.curve_number])
        deviation = np.hypot(family.widen(at.deviation, at.value), own.deviation(at.value))
        beyond = np.maximum(at.value[0] - family.value, family.value - at.value[1])
        side = (family.value > at.value[1]).astype(int)
        sigma = np.maximum(deviation[side, np.arange(len(side))], np.finfo(float).tiny)
        square = np.clip(np.nan_to_num(beyond / sigma, nan=0.0), 0.0, FURTHEST) ** 2
        sums = np.bincount(family.curve_number, square, minlength=len(family.curves))
        for key, value in zip(family.set_ups, sums, strict=True):
            result[key] = result.get(key, 0.0) + float(value)
    return result
