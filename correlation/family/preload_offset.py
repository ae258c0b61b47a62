r"""Preload offsets of set-ups: by how much each is pressed more or less than the model.

No assembly presses its contacts twice alike, and where they slip a per cent of preload may change an amplitude by
several. Limits hold for one preload. The offsets are those that leave least of all families outside:

.. math:: \min_{q} \; \sum_j \min\left(\frac{o_j(q)^2}{\sigma_j^2}, 9\right) + \frac{q^2}{\sigma_q^2},
          \qquad |q| \le 3 \sigma_q ,

with o the distance of a reading outside of its limits, 0 inside, and sigma its noise. Groups of preloads follow one
after the other, and the frequency offsets are estimated anew with them. What is outside then is outside for every
preload that set-ups may have.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from correlation.family.band import PredictedBand
from correlation.family.correction import FamilyCorrection, SetUp, Values
from correlation.family.family import Family
from correlation.family.frequency_offset import (
    FURTHEST,
    estimate_frequency_offsets,
    outside_of_limits,
    penalty,
)
from correlation.family.noise import ReadingNoise
from correlation.noise.scatter import USUAL_JITTER

#: Standard deviation of a preload from one set-up to another, relative [-].
SCATTER = USUAL_JITTER[-1]
#: Largest offset that is looked at [-].
PRELOAD_SPAN = FURTHEST * SCATTER
#: Offsets to either side, and how often all groups are gone through: each time between the neighbours of the last best.
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
        Families as they were measured, and band and noise of each.
    set_up, model
        Standard deviations of the frequency from one set-up to another and of the model, relative [-].
    """
    corrections = [FamilyCorrection(family, band) for family, band in zip(families, bands, strict=True)]
    n_group = max((len(band.by_preload) for band in bands), default=0)
    keys = list(dict.fromkeys(key for family in families for key in family.set_ups))
    offsets = {key: np.zeros(n_group) for key in keys}
    # The smallest step first, so that of equal ones it is taken.
    steps = np.array(sorted(range(-OFFSET_STEPS, OFFSET_STEPS + 1), key=abs)) / OFFSET_STEPS
    for span in PRELOAD_SPAN / OFFSET_STEPS ** np.arange(ROUNDS if n_group else 0):
        corrected = [item.corrected(offsets) for item in corrections]
        frequency = estimate_frequency_offsets(corrected, bands, noise, set_up=set_up, model=model)
        for group in range(n_group):
            costs = []
            for step in span * steps:
                tried = {key: value + step * np.eye(n_group)[group] for key, value in offsets.items()}
                outside = outside_of_limits([item.corrected(tried) for item in corrections], bands, noise, frequency)
                costs.append([outside.get(key, 0.0) + penalty(tried[key][group], SCATTER) for key in keys])
            for key, best in zip(keys, np.argmin(costs, axis=0), strict=True):
                offsets[key][group] += span * steps[best]
    return offsets
