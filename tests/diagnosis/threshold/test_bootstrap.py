"""What chance does in a layout: draws without any effect, and the tail that some dozens of them tell."""

import numpy as np
import pytest
from scipy.stats import chi2, f, gumbel_r

from correlation.campaign.measurement import Campaign
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.refit import fit_quickly
from diagnosis.screening import screen
from diagnosis.threshold.bootstrap import REAL_STRUCTURE_MARGIN, Trial, fit_thresholds, run_null_trial
from diagnosis.threshold.simulation import Simulation
from tests.slow import slow

SEEDS = range(2)
#: Every so many of the candidates.
SOME = 4


def trials(gains: np.ndarray, misfits: np.ndarray) -> list[Trial]:
    pairs = zip(gains.tolist(), misfits.tolist(), strict=True)
    return [Trial(seed=seed, gain=gain, misfit=misfit) for seed, (gain, misfit) in enumerate(pairs)]


def test_the_tail_of_gumbels_law_is_told() -> None:
    draw = np.random.default_rng(1)
    gains, misfits = (gumbel_r.rvs(loc=m, scale=s, size=20_000, random_state=draw) for m, s in ((6, 2), (9, 3)))
    limits = fit_thresholds(trials(gains, misfits), false_alarms=0.01)
    # The standard deviation of 20,000 draws is known to 1 %; the quantile is 4.6 scales away.
    assert limits.gain == pytest.approx(REAL_STRUCTURE_MARGIN * gumbel_r.isf(0.01, loc=6, scale=2), rel=0.03)
    assert limits.misfit == pytest.approx(gumbel_r.isf(0.01, loc=9, scale=3), rel=0.03)
    assert (limits.false_alarms, limits.n_trial) == (0.01, 20_000)


def test_chance_does_as_much_as_one_candidate_alone() -> None:
    limits = fit_thresholds(trials(np.zeros(4), np.zeros(4)), false_alarms=0.01)
    assert limits.gain == limits.misfit == pytest.approx(chi2.isf(0.01, 1))


@pytest.mark.parametrize("n", [0, 1])
def test_a_trial_is_no_distribution(n: int) -> None:
    with pytest.raises(ValueError, match=f"{n} trials give no distribution"):
        fit_thresholds(trials(np.zeros(n), np.zeros(n)))


@pytest.fixture(scope="module")
def simulation(heavy: Arrangement, heavy_campaign: Campaign) -> Simulation:
    return Simulation(campaign=heavy_campaign, arrangement=heavy)


@pytest.fixture(scope="module")
def drawn(simulation: Simulation, listed: Catalogue) -> list[Trial]:
    """The campaign hides something; the draws do not."""
    return [run_null_trial(simulation, listed.candidates[::SOME], seed) for seed in SEEDS]


def test_draws_without_an_effect_gain_what_chance_does(
    drawn: list[Trial], listed: Catalogue, heavy: Arrangement
) -> None:
    gains = np.array([trial.gain for trial in drawn])
    # Noise is told by four repeats, so that the largest of so many chi-squares has the tail of an F distribution: that
    # of one and of the 9 degrees of freedom that a point's own variance and the pooled one count for.
    n = len(listed.candidates[::SOME]) * len(SEEDS)
    assert (gains >= 0).all()
    assert gains.max() < f.isf(1e-3 / n, 1, 9)
    # What the hidden mass gains is of another kind.
    (hidden,) = screen(heavy, [listed.effect("mass at tip z")])
    assert heavy.fit.chi2 - fit_quickly(heavy, hidden).chi2 > 2 * gains.max()
    assert len({trial.misfit for trial in drawn}) == len(SEEDS)


@slow
def test_a_seed_is_a_draw(simulation: Simulation, listed: Catalogue, drawn: list[Trial]) -> None:
    assert run_null_trial(simulation, listed.candidates[::SOME], SEEDS[1]) == drawn[1]
