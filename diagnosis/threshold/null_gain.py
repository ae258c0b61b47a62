r"""How large the best gain is when nothing is missing: the search itself finds something in pure noise.

Under the null the whitened residual is a vector of independent standard normals with the calibration parameters
projected out; the best of all candidates is sought in each of many such vectors, within the bounds of each. What this
leaves out (the curvature of the model, errors beyond the covariance) is measured on campaigns in which nothing is
missing, as the ratio of their gains to these.

References
----------
Davison and Hinkley, Bootstrap Methods and their Application (1997), section 4.2: parametric bootstrap of a maximum.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.screening import Score

#: Residuals drawn, the seed they are drawn with, and how many at a time.
DRAWS, SEED, BATCH = 20_000, 2, 2_000


def draw_null_gains(scores: Sequence[Score]) -> Float[NDArray[np.float64], " n"]:
    """Best gain in each of many residuals without any effect, ascending, shape (n,).

    Parameters
    ----------
    scores
        Of all candidates; their directions already have the calibration parameters projected out.
    """
    seen = [score for score in scores if score.size > 0]
    if not seen:
        return np.zeros(1)
    directions = np.array([score.direction for score in seen])
    # The gains depend on the directions' inner products alone: draw in the space that they span.
    eigenvalues, vectors = np.linalg.eigh(directions @ directions.T)
    root = vectors * np.sqrt(np.maximum(eigenvalues, 0.0))
    one_sided = np.array([_one_sided(score) for score in seen])
    generator = np.random.default_rng(SEED)
    best = []
    for _ in range(DRAWS // BATCH):
        along = root @ generator.standard_normal((len(seen), BATCH))
        along = np.where(one_sided[:, None] * along < 0, 0.0, along)
        best.append((along**2).max(axis=0))
    return np.sort(np.concatenate(best))


def find_threshold(gains: Float[NDArray[np.float64], " n"], false_alarms: float) -> float:
    """Gain that a share of nulls exceeds."""
    return float(np.quantile(gains, 1 - false_alarms))


def _one_sided(score: Score) -> int:
    """Sign of the direction towards which the strength may grow alone; 0 for both."""
    parameter = score.effect.parameters[0]
    forward = np.sign(parameter.typical - parameter.vanishes)
    if parameter.lower == parameter.vanishes:
        return int(forward)
    return int(-forward) if parameter.upper == parameter.vanishes else 0
