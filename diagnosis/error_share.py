"""Covariances with the model error that a fit leaves, and with less of it.

A missing effect may have been taken for model error, which is then smaller beside the effect. So each explanation is
judged by the covariance that suits it best.
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
from diagnosis.screening import Score, compute_slopes, find_least, make_basis, project_out

#: Shares of the model error that are tried beside all of it [-].
LESS_ERROR = (0.1, 0.0)


class Weights(NamedTuple):
    """A covariance, with all that is fitted projected out."""

    whitening: Whitening
    basis: Matrix
    residual: Vector
    surplus: float
    """-2 ln p of the model beyond that by the covariance with all model error [-]."""

    def across(self, changes: Matrix) -> Matrix:
        """Whitened changes, shape (m, c), as rows of all data and priors."""
        whitened = np.pad(self.whitening(changes), ((0, len(self.residual) - len(changes)), (0, 0)))
        return project_out(self.basis, whitened)


def list_weights(arrangement: Arrangement) -> list[Weights]:
    """Covariances with the model error that the fit leaves, and with less of it."""
    train, fit = arrangement.train, arrangement.fit
    m, there = fit.n_number, train.has_prediction(fit.prediction)
    difference = train.difference(fit.prediction)
    jacobian, prior = train.whitening.unwhiten(fit.jacobian[:m]), fit.jacobian[m:]
    listed = [train]
    if train.model_error is not None and train.model_error.size != NO_ERROR:
        listed += [resize_model_error(train, train.model_error.size.scaled(share)) for share in LESS_ERROR]
    weights: list[Weights] = []
    costs = []
    for each in listed:
        basis = make_basis(np.concatenate([each.whitening(jacobian), prior]) * fit.unknowns.size)
        residual = np.concatenate([np.where(there, each.whitening(difference), NOT_FOUND), fit.residual[m:]])
        across = project_out(basis, residual)
        costs.append(float(across @ across) + each.log_weight)
        weights.append(Weights(each.whitening, basis, across, costs[-1] - costs[0]))
    return weights


def rank_by_suited_gains(arrangement: Arrangement, scores: Sequence[Score]) -> list[Score]:
    """Scores with the largest gain by any of these covariances, best first."""
    if arrangement.model_error_size == NO_ERROR:
        return list(scores)
    # Screening has the slopes already, but of effects that the covariance with all model error hides.
    hidden = [score.effect for score in scores if not score.slope.any()]
    computed = dict(zip((effect.name for effect in hidden), compute_slopes(arrangement, hidden), strict=True))
    slopes = [computed.get(score.effect.name, score.slope) for score in scores]
    gains = _compute_gains(arrangement, [score.effect for score in scores], slopes).max(axis=0)
    suited = [replace(score, gain=max(score.gain, float(gain))) for score, gain in zip(scores, gains, strict=True)]
    return sorted(suited, key=lambda score: -score.gain)


def compute_suited_gains(arrangement: Arrangement, effects: Sequence[Effect]) -> Float[NDArray[np.float64], "w e"]:
    """Gain of each effect to first order by each of these covariances, that with all model error first [-]."""
    return _compute_gains(arrangement, effects, compute_slopes(arrangement, effects))


def _compute_gains(
    arrangement: Arrangement, effects: Sequence[Effect], slopes: Iterable[Vector]
) -> Float[NDArray[np.float64], "w e"]:
    weights, m = list_weights(arrangement), arrangement.fit.n_number
    gains = np.zeros((len(weights), len(effects)))
    for number, (effect, slope) in enumerate(zip(effects, slopes, strict=True)):
        change = arrangement.train.whitening.unwhiten(slope[:m, None])
        for each, row in zip(weights, gains, strict=True):
            row[number] = find_least(effect, each.across(change)[:, 0], each.residual).gain - each.surplus
    return gains
