"""Parametric bootstrap: standard deviations of a fit from campaigns simulated with the fitted model.

The curvature of chi^2 gives standard deviations for a linear model with normally distributed errors. The effect of
friction histories is neither: a state that slips in one repeat and sticks in the next changes an estimate by many
standard deviations. A few campaigns are therefore simulated, with each history followed through stick and slip, and the
change of each fit is computed to first order.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import average_readings
from correlation.uncertainty.interval import compute_student_factor
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration import Fit, Vector, invert_curvature
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.finalist import Finalist
from diagnosis.fit.finer_model import widen_by_finer_models
from diagnosis.fit.problem import Refit
from diagnosis.threshold.simulation import Simulation

#: Number of simulated campaigns, and the seed.
DRAWS, SEED = 8, 1
#: Factor on the standard deviations. Of 95 hidden effects of random rigs that a diagnosis named, intervals with this
#: factor cover 90, without it 87. The simulation lacks the contacts of the specimen and the curvature of effects.
INTERVAL_WIDENING = 1.1
#: Factor on a standard deviation estimated from `DRAWS` campaigns, by Student's distribution.
STUDENT_FACTOR = compute_student_factor(DRAWS)


def widen_intervals(campaign: Campaign, best: Finalist, fits: Sequence[Finalist]) -> list[Refit]:
    """Refits with standard deviations that are at least those over campaigns simulated with the best fit.

    The covariance of calibration parameters is also widened by finer models.

    Parameters
    ----------
    campaign
        Measurements.
    best
        Fit with whose model campaigns are simulated.
    fits
        Fits of the same measurements, each with its own covariance.
    """
    differences = _simulate_differences(campaign, replace(best.arrangement, fit=best.refit.fit))
    widened = []
    for item in fits:
        fit = carry_over(item.refit.fit, item.arrangement.train.whitening(differences))
        fit = replace(fit, covariance=fit.unknowns.limited(INTERVAL_WIDENING**2 * fit.covariance))
        widened.append(replace(item.refit, fit=widen_by_finer_models(fit, item.arrangement.finer)))
    return widened


def _simulate_differences(campaign: Campaign, arrangement: Arrangement) -> Float[NDArray[np.float64], "m n"]:
    """Differences of features between simulated campaigns and the prediction of their model."""
    train, prediction = arrangement.train, arrangement.fit.prediction
    simulation = Simulation(campaign=campaign, arrangement=arrangement, held_out=False)
    generator = np.random.default_rng(SEED)
    column = np.unique(campaign.measurement.repeat, return_inverse=True)[1]
    measured, predicted = train.residual(prediction), train.features.of_values(prediction.value)
    drawn = []
    for _ in range(DRAWS):
        read = average_readings(simulation.read(generator), simulation.point, column, train.observed.repeat.shape)
        drawn.append(_compute_difference(train, read, predicted))
    # A simulated campaign that is further from the model than the measured one has too much scatter: scale it down.
    sizes = [min(1.0, float(np.linalg.norm(measured) / np.linalg.norm(train.whitening(item)))) for item in drawn]
    return np.column_stack([size * item for size, item in zip(sizes, drawn, strict=True)])


def _compute_difference(train: Comparison, read: Complex[NDArray[np.complex128], "k R"], predicted: Vector) -> Vector:
    """Features of readings less those of a prediction; zero where either is missing."""
    taken = np.asarray(np.isfinite(read) & train.observed.taken)
    seen: Bool[NDArray[np.bool_], " k"] = np.any(taken, axis=1)
    repeat = np.where(taken, read, train.observed.mean[:, None])
    drawn = train.features.of_repeats(repeat, taken | ~seen[:, None])
    there = seen[train.features.row] & np.isfinite(predicted) & np.isfinite(drawn)
    return np.where(there, drawn - predicted, 0.0)


def carry_over(fit: Fit, differences: Float[NDArray[np.float64], "m n"]) -> Fit:
    """Fit with standard deviations over simulated whitened differences, where these are larger."""
    m, size = len(differences), fit.unknowns.size
    data, prior = fit.jacobian[:m], fit.jacobian[m:]
    shape = invert_curvature(fit.jacobian, size)
    moved = shape @ (data.T @ differences)
    # The priors contribute to the variance as well.
    seen = (moved**2).mean(axis=1) + np.diag(shape @ (prior.T @ prior) @ shape)
    known = np.diag(fit.covariance)
    more = np.sqrt(np.maximum(STUDENT_FACTOR**2 * seen / np.where(known > 0, known, np.inf), 1.0))
    return replace(fit, covariance=fit.unknowns.limited(fit.covariance * np.outer(more, more)))
