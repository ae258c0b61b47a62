"""Detection thresholds: the gains that an effect and an unknown force must exceed to be named."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import chdtri

from correlation.noise.symmetric_root import symmetric_root
from diagnosis.screening import Score

#: Factor on the gains of the linear theory: by experience refits gain more [-].
LINEAR_MARGIN = 2.0
#: Threshold of the gain of an unknown force as a multiple of that of an effect, by experience.
UNKNOWN_FORCE_RATIO = 1.5
#: Least threshold of the gain of an unknown force by the linear theory, for any number of effects: the chance gain of
#: eight parameters at one of ten places. A bootstrap computes the chance gains of its layout.
LEAST_UNKNOWN_FORCE_GAIN = 18.0


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """Detection thresholds of one layout of tests, sensors and model.

    Parameters
    ----------
    gain
        Fall of chi^2 by the best effect that a share `false_alarms` of campaigns without any effect exceeds [-].
    misfit
        Gain of an unknown force at one place, less the number of its parameters, that the same share exceeds [-].
    false_alarms
        Share of campaigns [-].
    n_trial
        Number of simulated campaigns without any effect; 0 if the thresholds are those of the linear theory [-].
    """

    gain: float
    misfit: float
    false_alarms: float = 0.01
    n_trial: int = 0


#: For data on which the held-out error decides about effects.
NO_THRESHOLDS = Thresholds(gain=0.0, misfit=0.0)


def compute_linear_thresholds(scores: Sequence[Score], false_alarms: float = 0.01) -> Thresholds:
    """Detection thresholds of the linear theory with a margin, for a layout without a bootstrap.

    The least threshold is based on a chi-square of one degree of freedom, for the case that model error hides all
    effects in the screening.
    """
    least = float(chdtri(1, false_alarms))
    gain = LINEAR_MARGIN * max(find_threshold(draw_null_gains(scores), false_alarms), least)
    return Thresholds(
        gain=gain, misfit=max(UNKNOWN_FORCE_RATIO * gain, LEAST_UNKNOWN_FORCE_GAIN), false_alarms=false_alarms
    )


#: Number of drawn residuals, their seed, and number of residuals drawn at once.
DRAWS, SEED, BATCH = 20_000, 2, 2_000


def draw_null_gains(scores: Sequence[Score]) -> Float[NDArray[np.float64], " n"]:
    """Largest gain in each of many random residuals without any effect, ascending, shape (n,).

    Without an effect the whitened residual is a vector of independent standard normals with the calibration parameters
    projected out. The largest gain of all candidates, within their bounds, is computed for each draw. The curvature of
    the model and errors beyond the covariance are not included; they are measured on campaigns without an effect.

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
    root = symmetric_root(directions @ directions.T)
    # Directions point to the typical strength; a strength with a bound at its neutral value only grows along them.
    strengths = [score.effect.parameters[0] for score in seen]
    one_sided = np.array([item.vanishes in (item.lower, item.upper) for item in strengths])
    generator = np.random.default_rng(SEED)
    best = []
    for _ in range(DRAWS // BATCH):
        along = root @ generator.standard_normal((len(seen), BATCH))
        along = np.where(one_sided[:, None] & (along < 0), 0.0, along)
        best.append((along**2).max(axis=0))
    return np.sort(np.concatenate(best))


def find_threshold(gains: Float[NDArray[np.float64], " n"], false_alarms: float) -> float:
    """Gain that a share of residuals without any effect exceeds."""
    return float(np.quantile(gains, 1 - false_alarms))
