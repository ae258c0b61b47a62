r"""What chance may do in one layout of tests, sensors and model: a bootstrap of the whole procedure.

Measurements are drawn anew from the calibrated model and the covariance of the campaign, without any effect; then all
is done as with measured ones: calibration, screening, refits, unknown forces. The largest gain of each draw is the
largest of many nearly chi-square variables, so that its distribution is Gumbel's, and some dozens of draws tell its
tail:

.. math:: P(g < x) = \exp(-e^{-(x - m) / s}), \qquad s = \sqrt 6\, \sigma_g / \pi, \qquad m = \bar g - \gamma s .

References
----------
Davison and Hinkley, Bootstrap Methods and their Application (1997), section 4.2; Coles, An Introduction to Statistical
Modeling of Extreme Values (2001), section 3.1.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.stats import chi2

from diagnosis.arrangement import Arrangement
from diagnosis.calibration import calibrate
from diagnosis.comparison import Comparison
from diagnosis.decision import misfit
from diagnosis.effect.candidate import Effect
from diagnosis.limits import Limits
from diagnosis.localisation import localise
from diagnosis.refit import fitted, shortlist
from diagnosis.screening import screen

#: Draws that a layout deserves.
TRIALS = 40


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One draw without any effect.

    Parameters
    ----------
    seed
        Of the draw.
    gain
        Largest fall of chi^2 by any effect.
    misfit
        Largest gain of an unknown force, beyond its numbers.
    """

    seed: int
    gain: float
    misfit: float


def null_trial(arrangement: Arrangement, effects: Sequence[Effect], seed: int) -> Trial:
    """Draw measurements without any effect, and diagnose them.

    Parameters
    ----------
    arrangement
        Of a campaign in this layout.
    effects
        Candidates.
    seed
        Of the draw; trials are independent.
    """
    generator = np.random.default_rng(seed)
    fit = arrangement.fit
    train = _drawn(arrangement.train, arrangement.train.features.of_values(fit.prediction.value), generator)
    found = calibrate(train, fit.unknowns, fit.values, fit.prediction, slopes=fit.jacobian, exact=True)
    drawn = replace(arrangement, train=train, fit=found)
    scores = screen(drawn, effects)
    gains = [found.chi2 - fitted(drawn, score).chi2 for score in shortlist(scores)]
    return Trial(
        seed=seed, gain=max(gains, default=0.0), misfit=max((misfit(place) for place in localise(drawn)), default=0.0)
    )


def limits_of(trials: Sequence[Trial], false_alarms: float = 0.01) -> Limits:
    """Limits that a share of campaigns without any effect exceeds, by Gumbel's law of the trials.

    Raises
    ------
    ValueError
        Fewer than two trials.
    """
    if len(trials) < 2:
        raise ValueError(f"{len(trials)} trials tell no distribution: make at least 2")
    # One candidate alone does as much as a chi-square of one degree of freedom.
    least = float(chi2.isf(false_alarms, 1))
    return Limits(
        gain=max(_quantile(np.array([trial.gain for trial in trials]), 1 - false_alarms), least),
        misfit=max(_quantile(np.array([trial.misfit for trial in trials]), 1 - false_alarms), least),
        false_alarms=false_alarms,
        n_trial=len(trials),
    )


def _drawn(
    comparison: Comparison, expected: Float[NDArray[np.float64], " m"], generator: np.random.Generator
) -> Comparison:
    return replace(comparison, measured=expected + comparison.whitening.sample(generator))


def _quantile(values: Float[NDArray[np.float64], " n"], probability: float) -> float:
    scale = np.sqrt(6) * values.std(ddof=1) / np.pi
    mode = values.mean() - np.euler_gamma * scale
    return float(mode - scale * np.log(-np.log(probability)))
