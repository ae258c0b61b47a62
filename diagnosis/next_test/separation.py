r"""Separation of models by future measurements, and the probability that these decide between them.

Model a predicts the new data with mean s_a and covariance :math:`S_a = C + A_a A_a^T`, where C is the covariance of
noise and model error, and A_a the change by its parameters, which are uncertain after the old data. The posterior odds
of a against b are the prior odds times the ratio of both densities. With the mean of both covariances its logarithm is

.. math:: \lambda_{ab} \sim N(\pm d^2 / 2,\, d^2), \qquad d^2 = (s_a - s_b)^T S^{-1} (s_a - s_b), \quad
          S = C + \tfrac12 (A_a A_a^T + A_b A_b^T),

with the sign depending on the true model. This projects out parameters that the new data can adjust: a difference that
the parameters of both models compensate within their uncertainty does not separate the models.

References
----------
Box and Hill, Discrimination among mechanistic models, Technometrics 9 (1967), 57-71: the next experiment is the one
whose predictive distributions differ most. Hunter and Reiner, Designs for discriminating between two rival models,
Technometrics 7 (1965), 307-323: the same for two models whose parameters are known.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import ndtr

from correlation.noise.covariance import Whitening
from diagnosis.decision.evidence import CREDIBLE

Signature = Float[NDArray[np.float64], " m"]
Spread = Float[NDArray[np.float64], "m p"]
Pairs = Float[NDArray[np.float64], "n n"]
Probabilities = Float[NDArray[np.float64], " n"]


def compute_separation(signatures: list[Signature], spreads: list[Spread], errors: Whitening) -> Pairs:
    """d^2 of each pair of n models, shape (n, n) [-].

    Parameters
    ----------
    signatures
        Predicted values s of each model, shape (m,); values that are not finite for one model of a pair are ignored.
    spreads
        Changes A of the values by one standard deviation of the parameters of each model, shape (m, p) each.
    errors
        Covariance C of noise and model error.
    """
    n = len(signatures)
    result = np.zeros((n, n))
    for a in range(n):
        for b in range(a):
            whitened = whiten_difference((signatures[a], signatures[b]), (spreads[a], spreads[b]), errors)
            result[a, b] = result[b, a] = whitened @ whitened
    return result


def whiten_difference(
    signatures: tuple[Signature, Signature], spreads: tuple[Spread, Spread], errors: Whitening
) -> Signature:
    """S^(-1/2) (s_a - s_b) of one pair, shape (m,): its squares are the contributions to d^2."""
    there = np.isfinite(signatures[0]) & np.isfinite(signatures[1])
    difference = np.where(there, signatures[0] - signatures[1], 0.0)
    uncertain = np.where(there[:, None], np.column_stack(spreads), 0.0) / np.sqrt(2)
    return errors.with_modes(np.nan_to_num(uncertain))(difference)


def compute_decision_probability(separation: Pairs, probability: Probabilities) -> float:
    r"""Expected probability that the true one of n models reaches a probability of at least q = `CREDIBLE` [-].

    For two models it is :math:`\sum_a p_a \Phi((\ln(p_a / p_b) + d^2/2 - \ln(q / (1 - q))) / d)`. For more models each
    rival is allowed an equal share of 1 - q, and the probabilities that a rival exceeds it are added (Boole's
    inequality), which gives a lower bound.

    Parameters
    ----------
    separation
        d^2 of each pair, shape (n, n) [-].
    probability
        Probability of each model before the measurement, shape (n,) [-].
    """
    n = len(probability)
    wanted = np.log(CREDIBLE / (1 - CREDIBLE) * max(n - 1, 1))
    total = 0.0
    for a in range(n):
        failing = 0.0
        for b in range(n):
            if a == b or not probability[b]:
                continue
            distance = float(np.sqrt(separation[a, b]))
            margin = np.log(max(probability[a], 1e-300) / probability[b]) + distance**2 / 2 - wanted
            failing += float(ndtr(-margin / distance)) if distance else float(margin < 0)
        total += probability[a] * max(1 - failing, 0.0)
    return float(total)
