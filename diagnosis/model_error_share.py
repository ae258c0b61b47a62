"""Covariances of a fit with its estimated model error, and with smaller shares of it.

A missing effect may have been mistaken for model error, which is smaller once the effect is in the model. Each
explanation is therefore evaluated with the covariance under which it gains most.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.noise.covariance import Whitening
from correlation.noise.error_size import NO_ERROR
from diagnosis.candidate.effect import Effect
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.calibration import Matrix, Vector
from diagnosis.fit.comparison import NOT_FOUND
from diagnosis.fit.weighting import resize_model_error
from diagnosis.screening import Score, compute_slopes, make_basis, minimise_along_change, project_out

#: Shares of the model error that are tried in addition to the full error [-].
LESS_ERROR = (0.1, 0.0)


class ProjectedCovariance(NamedTuple):
    """Data whitened by one covariance, with the fitted parameters projected out."""

    whitening: Whitening
    basis: Matrix
    residual: Vector
    cost_difference: float
    """-2 ln p of the model, less that with the full model error [-]."""

    def across(self, changes: Matrix) -> Matrix:
        """Whitened and projected changes, shape (m, c), with rows of all data and priors."""
        whitened = np.pad(self.whitening(changes), ((0, len(self.residual) - len(changes)), (0, 0)))
        return project_out(self.basis, whitened)


def list_covariances(arrangement: Arrangement) -> list[ProjectedCovariance]:
    """List the covariances with the full estimated model error, and with the shares `LESS_ERROR` of it."""
    train, fit = arrangement.train, arrangement.fit
    m, there = fit.n_number, train.has_prediction(fit.prediction)
    difference = train.difference(fit.prediction)
    jacobian, prior = train.whitening.unwhiten(fit.jacobian[:m]), fit.jacobian[m:]
    listed = [train]
    if train.model_error is not None and train.model_error.size != NO_ERROR:
        listed += [resize_model_error(train, train.model_error.size.scaled(share)) for share in LESS_ERROR]
    weights: list[ProjectedCovariance] = []
    costs = []
    for item in listed:
        basis = make_basis(np.concatenate([item.whitening(jacobian), prior]) * fit.unknowns.size)
        residual = np.concatenate([np.where(there, item.whitening(difference), NOT_FOUND), fit.residual[m:]])
        across = project_out(basis, residual)
        costs.append(float(across @ across) + item.log_weight)
        weights.append(ProjectedCovariance(item.whitening, basis, across, costs[-1] - costs[0]))
    return weights


def rank_by_best_covariance(arrangement: Arrangement, scores: Sequence[Score]) -> list[Score]:
    """Rank scores by the largest gain under any of these covariances, best first."""
    if arrangement.model_error_size == NO_ERROR:
        return list(scores)
    # The screening has computed the slopes, except those of effects hidden by the full model error.
    hidden = [score.effect for score in scores if not score.slope.any()]
    computed = dict(zip((effect.name for effect in hidden), compute_slopes(arrangement, hidden), strict=True))
    slopes = [computed.get(score.effect.name, score.slope) for score in scores]
    gains = _compute_gains(arrangement, [score.effect for score in scores], slopes).max(axis=0)
    suited = [replace(score, gain=max(score.gain, float(gain))) for score, gain in zip(scores, gains, strict=True)]
    return sorted(suited, key=lambda score: -score.gain)


def compute_gains_by_covariance(
    arrangement: Arrangement, effects: Sequence[Effect]
) -> Float[NDArray[np.float64], "w e"]:
    """First-order gain of each effect with each of these covariances, that with the full model error first [-]."""
    return _compute_gains(arrangement, effects, compute_slopes(arrangement, effects))


def _compute_gains(
    arrangement: Arrangement, effects: Sequence[Effect], slopes: Iterable[Vector]
) -> Float[NDArray[np.float64], "w e"]:
    weights, m = list_covariances(arrangement), arrangement.fit.n_number
    gains = np.zeros((len(weights), len(effects)))
    for number, (effect, slope) in enumerate(zip(effects, slopes, strict=True)):
        change = arrangement.train.whitening.unwhiten(slope[:m, None])
        for item, row in zip(weights, gains, strict=True):
            row[number] = (
                minimise_along_change(effect, item.across(change)[:, 0], item.residual).gain - item.cost_difference
            )
    return gains
