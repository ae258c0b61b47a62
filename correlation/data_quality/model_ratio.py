"""Ratios of readings to a model."""

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Measurement
from correlation.feature.observation import find_points
from correlation.prediction import Points

Values = Complex[NDArray[np.complex128], " n"]


def find_model_ratios(
    campaign: Campaign, points: Points, predicted: Complex[NDArray[np.complex128], " k"]
) -> tuple[Measurement, Values]:
    """Fundamentals that neither the sensor nor the model has zero, and their ratios to the model, shape (n,) [-].

    Parameters
    ----------
    campaign
        Campaign.
    points, predicted
        Points and the prediction of the model there, shape (k,).
    """
    table, point = campaign.measurement, find_points(campaign, points)
    model = np.where(point >= 0, predicted[point], np.nan)
    there = (table.harmonic == 1) & np.isfinite(model) & (model != 0) & (table.value != 0)
    return table.where(there), np.asarray(table.value[there] / model[there])
