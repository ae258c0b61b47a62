"""How far a fit strays by chance: what becomes of it in campaigns that are drawn from the fitted model.

The curvature of chi^2 tells that of a model that is linear, measured with an error that is normally distributed. What
friction histories do is neither: a state that begins to slip in one repeat and sticks in the next moves an estimate by
many of its standard deviations. So a few campaigns are drawn from the model, each history followed through stick and
slip, and each fit is taken to each of them to first order.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import NDArray
from scipy import stats

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import average_readings
from diagnosis.decision.verdict import INTERVAL
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration import Fit, Vector, inverse
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.finer_model import widen_by_finer_models
from diagnosis.fit.problem import Refit
from diagnosis.threshold.simulation import Simulation

#: Campaigns drawn, and the seed.
DRAWS, SEED = 8, 1
#: Of 19 effects that were hidden on the virtual bench, 15 lay within intervals without this factor, and 18 with it.
#: Draws do not know which contacts a specimen has, nor that effects bend what they change.
BEYOND = 1.3
#: A deviation of so few draws may itself be too small: by Student's distribution an interval must be wider by this.
FEW = float(stats.t.ppf(stats.norm.cdf(INTERVAL), DRAWS)) / INTERVAL


def widen_intervals(campaign: Campaign, arrangement: Arrangement, best: Refit, refits: Sequence[Refit]) -> list[Refit]:
    """Refits with the deviations that campaigns drawn from the best of them have, where those are larger.

    Calibration parameters are as uncertain as finer models say as well.

    Parameters
    ----------
    campaign, arrangement
        Measurements beside the model.
    best
        The model that campaigns are drawn from.
    refits
        Fits of the same measurements.
    """
    strayed = _strayed(campaign, replace(arrangement, fit=best.fit))
    fits = [carry_over(each.fit, strayed) for each in refits]
    fits = [replace(fit, covariance=BEYOND**2 * fit.covariance) for fit in fits]
    return [
        replace(each, fit=widen_by_finer_models(fit, arrangement.finer)) for each, fit in zip(refits, fits, strict=True)
    ]


def _strayed(campaign: Campaign, arrangement: Arrangement) -> Float[NDArray[np.float64], "m n"]:
    """Whitened differences between campaigns that are drawn from a model and what it predicts."""
    train, prediction = arrangement.train, arrangement.fit.prediction
    simulation = Simulation(campaign=campaign, arrangement=arrangement, held_out=False)
    generator = np.random.default_rng(SEED)
    column = np.unique(campaign.measurement.repeat, return_inverse=True)[1]
    measured, predicted = train.residual(prediction), train.features.of_values(prediction.value)
    drawn = []
    for _ in range(DRAWS):
        read = average_readings(simulation.read(generator), simulation.point, column, train.observed.repeat.shape)
        drawn.append(train.whitening(_difference(train, read, predicted)))
    # A draw that lies further from the model than what was measured is wilder than the structure is.
    sizes = [min(1.0, float(np.linalg.norm(measured) / np.linalg.norm(each))) for each in drawn]
    return np.column_stack([size * each for size, each in zip(sizes, drawn, strict=True)])


def _difference(train: Comparison, read: Complex[NDArray[np.complex128], "k R"], predicted: Vector) -> Vector:
    """Features of readings less those of a prediction; zero where there is no number."""
    taken = np.asarray(np.isfinite(read) & train.observed.taken)
    seen: Bool[NDArray[np.bool_], " k"] = np.any(taken, axis=1)
    repeat = np.where(taken, read, train.observed.mean[:, None])
    drawn = train.features.of_repeats(repeat, taken | ~seen[:, None])
    there = seen[train.features.row] & np.isfinite(predicted) & np.isfinite(drawn)
    return np.where(there, drawn - predicted, 0.0)


def carry_over(fit: Fit, strayed: Float[NDArray[np.float64], "m n"]) -> Fit:
    """A fit with the deviations that it has over some whitened differences, where those are larger."""
    m, size = len(strayed), fit.unknowns.size
    data, prior = fit.jacobian[:m], fit.jacobian[m:]
    shape = inverse(fit.jacobian, size)
    moved = shape @ (data.T @ strayed)
    # Priors stray as they say.
    seen = (moved**2).mean(axis=1) + np.diag(shape @ (prior.T @ prior) @ shape)
    known = np.diag(fit.covariance)
    more = np.sqrt(np.maximum(FEW**2 * seen / np.where(known > 0, known, np.inf), 1.0))
    return replace(fit, covariance=fit.covariance * np.outer(more, more))
