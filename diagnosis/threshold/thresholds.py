"""Detection thresholds: the gain and the misfit that a diagnosis must exceed before it claims anything."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.screening import Score

#: What the linear theory leaves out, by experience: refits gain more than it says.
MARGIN = 2.0
#: What an unknown force gains beyond its numbers where nothing is missing; of the order of the gains of effects.
UNKNOWN_FORCE = 1.5
#: ... and at least, however few effects there are to try: that of eight numbers at one of ten places, by chance.
LEAST_MISFIT = 18.0


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """Thresholds of one layout of tests, sensors and model.

    Parameters
    ----------
    gain
        Fall of chi^2 by the best effect that a share `false_alarms` of campaigns without any effect exceeds.
    misfit
        What an unknown force at one place gains beyond the numbers that it has, exceeded as seldom.
    false_alarms
        That share [-].
    n_trial
        Campaigns without any effect that told them; 0 if they come from the linear theory alone.
    """

    gain: float
    misfit: float
    false_alarms: float = 0.01
    n_trial: int = 0


#: Where the gains of chi^2 decide nothing.
NO_THRESHOLDS = Thresholds(gain=0.0, misfit=0.0)


def compute_linear_thresholds(scores: Sequence[Score], false_alarms: float = 0.01) -> Thresholds:
    """Thresholds for a layout without a bootstrap: those of the linear theory with a margin."""
    gain = MARGIN * find_threshold(draw_null_gains(scores), false_alarms)
    return Thresholds(gain=gain, misfit=max(UNKNOWN_FORCE * gain, LEAST_MISFIT), false_alarms=false_alarms)


#: Residuals drawn, the seed they are drawn with, and how many at a time.
DRAWS, SEED, BATCH = 20_000, 2, 2_000


def draw_null_gains(scores: Sequence[Score]) -> Float[NDArray[np.float64], " n"]:
    """Best gain in each of many residuals without any effect, ascending, shape (n,).

    Without an effect the whitened residual is a vector of independent standard normals with the calibration parameters
    projected out; the best of all candidates is sought in each, within its bounds. What this leaves out (the curvature
    of the model, errors beyond the covariance) is measured on campaigns in which nothing is missing.

    Parameters
    ----------
    scores
        All candidates; their directions already have the calibration parameters projected out.

    References
    ----------
    Davison and Hinkley, Bootstrap Methods and their Application (1997), section 4.2: bootstrap of a maximum.
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
