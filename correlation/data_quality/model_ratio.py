"""Ratios of readings to the predictions of a model."""

from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Complex
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Measurement
from correlation.feature.observation import find_points
from correlation.prediction import Points
from correlation.row_group import group_medians, group_rows

#: Least ratio of a reading to its noise, or to the median distance of the repeats from their median [-].
MIN_READING_OVER_NOISE = 3.0
#: Least fraction of the readings of a sensor at a level above the noise, for a ratio [-].
MIN_CLEAR_SHARE = 0.5
#: Least number of repeats of a point for its scatter, one of which may be wrong.
FEWEST = 3

Values = Complex[NDArray[np.complex128], " n"]


def find_model_ratios(
    campaign: Campaign, points: Points, predicted: Complex[NDArray[np.complex128], " k"]
) -> tuple[Measurement, Values]:
    """Fundamentals that exceed their noise, and their ratios to the model, shape (n,) [-].

    Readings or predictions of zero are left out.

    Parameters
    ----------
    campaign
        Campaign.
    points, predicted
        Points and the prediction of the model there, shape (k,).
    """
    table, point = campaign.measurement, find_points(campaign, points)
    model = np.where(point >= 0, predicted[point], np.nan)
    there = (table.harmonic == 1) & np.isfinite(model) & (model != 0) & _stands_out(campaign)
    return table.where(there), np.asarray(table.value[there] / model[there])


@lru_cache(maxsize=2)  # several checks of one comparison use it
def _stands_out(campaign: Campaign) -> Bool[NDArray[np.bool_], " k"]:
    """Mask of readings above their stated noise and the scatter of their repeats, if most of their kind are, (k,).

    Otherwise the largest readings of pure noise would be included.
    """
    table, size = campaign.measurement, np.abs(campaign.measurement.value)
    stated = np.array([item.noise for item in campaign.sensors])[table.sensor]
    point = group_rows([table.test, table.level, table.frequency, table.sweep, table.sensor, table.harmonic]).number
    middle = group_medians(point, table.value.real) + 1j * group_medians(point, table.value.imag)
    scatter = group_medians(point, np.abs(table.value - middle[point]))
    lost = (np.bincount(point) >= FEWEST) & (np.abs(middle) <= MIN_READING_OVER_NOISE * scatter)
    clear = (size > MIN_READING_OVER_NOISE * np.hypot(stated[:, 0] * size, stated[:, 1])) & ~lost[point]
    kind = group_rows([table.test, table.level, table.sensor, table.harmonic]).number
    share = np.bincount(kind, clear) / np.bincount(kind)
    return np.asarray(clear & (share > MIN_CLEAR_SHARE)[kind])
