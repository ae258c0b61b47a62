r"""Preload offsets of set-ups: relative differences of their preloads from those of the model.

Preloads differ between assemblies, and with slip one per cent of preload may change an amplitude by several per cent.
Limits are valid for one preload. The offsets are those for which least of all families is outside:

.. math:: \min_{q} \; \sum_j \min\left(\frac{o_j(q)^2}{\sigma_j^2}, 9\right) + \frac{q^2}{\sigma_q^2},
          \qquad |q| \le 3 \sigma_q ,

with o the distance of a reading outside its limits, 0 inside, and sigma its noise. Groups of preloads are adjusted one
after the other, and the frequency offsets are estimated again in each round. A reading that remains outside is outside
for every possible preload of the set-ups.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from correlation.family.band import PredictedBand
from correlation.family.correction import FamilyCorrection, SetUp, Values
from correlation.family.family import Family
from correlation.family.frequency_offset import (
    FURTHEST,
    compute_penalty,
    estimate_frequency_offsets,
    sum_outside_of_limits,
)
from correlation.family.noise import ReadingNoise
from correlation.noise.scatter import USUAL_JITTER

#: Relative standard deviation of a preload between set-ups [-].
SCATTER = USUAL_JITTER[-1]
#: Largest offset that is tried [-].
PRELOAD_SPAN = FURTHEST * SCATTER
#: Number of offsets to either side, and of rounds over all groups; each round refines the range about the last optimum.
OFFSET_STEPS, ROUNDS = 6, 3


def estimate_preload_offsets(
    families: Sequence[Family],
    bands: Sequence[PredictedBand],
    noise: Sequence[ReadingNoise],
    *,
    set_up: float,
    model: float,
) -> Mapping[SetUp, Values]:
    """Natural logarithm of each preload over that of the model, by set-up, shape (g,) [-].

    Parameters
    ----------
    families, bands, noise
        Families as measured, and band and noise of each.
    set_up, model
        Relative standard deviations of the frequency between set-ups, and of the model [-].
    """
    corrections = [FamilyCorrection(family, band) for family, band in zip(families, bands, strict=True)]
    n_group = max((len(band.by_preload) for band in bands), default=0)
    keys = list(dict.fromkeys(key for family in families for key in family.set_ups))
    offsets = {key: np.zeros(n_group) for key in keys}
    # Smallest steps first, so that they are preferred at equal cost.
    steps = np.array(sorted(range(-OFFSET_STEPS, OFFSET_STEPS + 1), key=abs)) / OFFSET_STEPS
    for span in PRELOAD_SPAN / OFFSET_STEPS ** np.arange(ROUNDS if n_group else 0):
        corrected = [item.corrected(offsets) for item in corrections]
        frequency = estimate_frequency_offsets(corrected, bands, noise, set_up=set_up, model=model)
        for group in range(n_group):
            costs = []
            for step in span * steps:
                tried = {key: value + step * np.eye(n_group)[group] for key, value in offsets.items()}
                outside = sum_outside_of_limits(
                    [item.corrected(tried) for item in corrections], bands, noise, frequency
                )
                costs.append([outside.get(key, 0.0) + compute_penalty(tried[key][group], SCATTER) for key in keys])
            for key, best in zip(keys, np.argmin(costs, axis=0), strict=True):
                offsets[key][group] += span * steps[best]
    return offsets
