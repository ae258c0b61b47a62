r"""Separation of models by measurements that are not made yet, and the probability that these decide between them.

Model a predicts the new numbers with mean s_a and covariance :math:`S_a = C + A_a A_a^T`, where C is that of noise and
model error, and A_a is what its parameters, uncertain after the old data, change. The odds of a against b after the
measurement are those before times the ratio of both densities. With the mean of both covariances its logarithm is

.. math:: \lambda_{ab} \sim N(\pm d^2 / 2,\, d^2), \qquad d^2 = (s_a - s_b)^T S^{-1} (s_a - s_b), \quad
          S = C + \tfrac12 (A_a A_a^T + A_b A_b^T),

with the sign of the model that is true. Parameters that the new data may set again are so projected out: a change that
those of both models make up for within their uncertainty separates nothing.

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
        Predicted numbers s of each model, shape (m,); those that are not finite in one of a pair separate nothing.
    spreads
        Their changes A by one standard deviation of its parameters, shape (m, p) each.
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
    """S^(-1/2) (s_a - s_b) of one pair, shape (m,): its squares are the shares of the numbers in d^2."""
    there = np.isfinite(signatures[0]) & np.isfinite(signatures[1])
    difference = np.where(there, signatures[0] - signatures[1], 0.0)
    uncertain = np.where(there[:, None], np.column_stack(spreads), 0.0) / np.sqrt(2)
    return errors.with_modes(np.nan_to_num(uncertain))(difference)


def compute_decision_probability(separation: Pairs, probability: Probabilities) -> float:
    r"""Expected probability that the true model gets a probability of q = `CREDIBLE` and more, one of n being true [-].

    For two models it is :math:`\sum_a p_a \Phi((\ln(p_a / p_b) + d^2/2 - \ln(q / (1 - q))) / d)`. Of more, each rival
    may have the same share of 1 - q, and the chances that one of them has more are added (Boole): a lower bound.

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
