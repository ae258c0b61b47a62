r"""Detection thresholds of one layout of tests, sensors and model, by a bootstrap of the whole procedure.

Campaigns are simulated from the calibrated model, without any effect (see `simulation`), and diagnosed like measured
ones: noise from the repeats, calibration, screening, refits, the test on held-out data, unknown forces. The largest
gain of each campaign is the maximum of many variables. Its distribution is approximated by Gumbel's, so that some
dozens of campaigns determine the tail:

.. math:: P(g < x) = \exp(-e^{-(x - m) / s}), \qquad s = \sqrt 6\, \sigma_g / \pi, \qquad m = \bar g - \gamma s .

References
----------
Davison and Hinkley, Bootstrap Methods and their Application (1997), section 4.2; Coles, An Introduction to Statistical
Modeling of Extreme Values (2001), section 3.1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import chdtri

from diagnosis.candidate.catalogue import list_campaign_effects
from diagnosis.candidate.effect import Effect
from diagnosis.decision.evidence import compute_birge_ratio, compute_evidence
from diagnosis.diagnose import USUAL_PROGRESS, EffectChoice, screen_and_refit
from diagnosis.fit.arrangement import arrange_anew
from diagnosis.fit.finalist import refit_by_own_covariance, refit_each_by_own_covariance
from diagnosis.model_error_share import rank_by_best_covariance
from diagnosis.step import compute_step
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.threshold.simulation import Simulation
from diagnosis.unknown_force import compute_excess_gain, find_unknown_forces

#: Number of simulated campaigns per layout.
TRIALS = 40
#: Ratio of the gains in campaigns of a real structure to those in simulated ones, since the budget does not contain all
#: errors of the model. With this ratio, 3 of 100 campaigns of the virtual bench without any effect exceeded the
#: thresholds.
REAL_STRUCTURE_MARGIN = 1.5


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Result of one simulated campaign without any effect.

    Parameters
    ----------
    seed
        Seed of the simulation.
    gain
        Largest fall of chi^2 by an effect, less the loss of the held-out data, over the squared Birge ratio of its fit;
        0 if the held-out data refute all effects [-].
    misfit
        Largest gain of an unknown force less the number of its parameters, over the squared Birge ratio [-].
    """

    seed: int
    gain: float
    misfit: float


def run_null_trial(simulation: Simulation, effects: Sequence[Effect], seed: int) -> Trial:
    """Simulate a campaign without any effect, and diagnose it.

    Parameters
    ----------
    simulation
        Simulation of a campaign in this layout.
    effects
        Candidates.
    seed
        Seed of the simulation; trials of different seeds are independent.
    """
    campaign = simulation.draw(np.random.default_rng(seed))
    drawn = arrange_anew(simulation.arrangement, campaign)
    choice = EffectChoice(partial(rank_by_best_covariance, drawn), drawn.cost_with_error_left)
    _, baseline, refits = screen_and_refit(
        drawn, effects, compute_step, lambda _step, _share: None, USUAL_PROGRESS, choice=choice
    )
    find_catalogue = partial(list_campaign_effects, campaign, extra=simulation.extra)
    finalists = refit_each_by_own_covariance(
        drawn, refits, partial(refit_by_own_covariance, campaign, drawn, baseline, find_catalogue, drawn.train)
    )
    gains = [compute_evidence(item.refit) / compute_birge_ratio(item.refit) for item in finalists]
    force_gains = [
        compute_excess_gain(place) / compute_birge_ratio(baseline, place.gain) for place in find_unknown_forces(drawn)
    ]
    return Trial(seed=seed, gain=max(gains, default=0.0), misfit=max(force_gains, default=0.0))


def fit_thresholds(trials: Sequence[Trial], false_alarms: float = 0.01) -> Thresholds:
    """Detection thresholds that a share of campaigns without any effect exceeds, by Gumbel's distribution.

    The threshold of an effect includes `REAL_STRUCTURE_MARGIN`; that of an unknown force does not.

    Raises
    ------
    ValueError
        Fewer than two trials.
    """
    if len(trials) < 2:
        raise ValueError(f"{len(trials)} trials give no distribution: make at least 2")
    # The gain of a single candidate is a chi-square of one degree of freedom.
    least = float(chdtri(1, false_alarms))
    return Thresholds(
        gain=max(
            REAL_STRUCTURE_MARGIN * _estimate_quantile(np.array([trial.gain for trial in trials]), 1 - false_alarms),
            least,
        ),
        misfit=max(_estimate_quantile(np.array([trial.misfit for trial in trials]), 1 - false_alarms), least),
        false_alarms=false_alarms,
        n_trial=len(trials),
    )


def _estimate_quantile(values: Float[NDArray[np.float64], " n"], probability: float) -> float:
    scale = np.sqrt(6) * values.std(ddof=1) / np.pi
    mode = values.mean() - np.euler_gamma * scale
    return float(mode - scale * np.log(-np.log(probability)))
