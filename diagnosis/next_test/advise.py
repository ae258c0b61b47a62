"""Advice: the next test that best separates the models that a verdict leaves open, with its decision probability."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.noise.error_size import ErrorSize
from diagnosis.decision.verdict import Verdict
from diagnosis.fit.arrangement import Arrangement
from diagnosis.missing_law.place_law import MissingLaw
from diagnosis.next_test.candidate_model import CandidateModel, list_candidate_models
from diagnosis.next_test.list_tests import Tested, list_tests
from diagnosis.next_test.next_test import NextTest
from diagnosis.next_test.planned_noise import PlannedNoise
from diagnosis.next_test.separation import compute_decision_probability
from diagnosis.next_test.signature import ErrorSources, SetUpSignatures, SignatureCurve
from hbsolve.errors import ModelError

#: Difference of probabilities within which the shortest test is advised [-].
SAME_PROBABILITY = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class RankedTest:
    """A test with its decision probability.

    Parameters
    ----------
    test
        Test.
    separation
        d^2 of each pair of candidates, shape (n, n) [-].
    probability
        Probability that the test decides, and correctly [-].
    curve
        Reading that best separates the two most probable candidates; only for the advised test.
    """

    test: NextTest
    separation: Float[NDArray[np.float64], "n n"]
    probability: float
    curve: SignatureCurve | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Advice:
    """Advice on the next test.

    Parameters
    ----------
    names, probabilities
        Candidates, most probable first, and their present probabilities [-].
    ranked
        Tests, the advised one first.
    """

    names: tuple[str, ...]
    probabilities: tuple[float, ...]
    ranked: tuple[RankedTest, ...]

    @property
    def best(self) -> RankedTest:
        """The advised test."""
        return self.ranked[0]


def advise(
    campaign: Campaign, arrangement: Arrangement, verdict: Verdict, law: MissingLaw | None = None
) -> Advice | None:
    """Advise the next test.

    Parameters
    ----------
    campaign
        Present measurements.
    arrangement
        Arrangement of these measurements, without the effects of the verdict.
    verdict
        Verdict.
    law
        Recovered law of an unknown force.

    Returns
    -------
    The advice; None if the verdict leaves fewer than two models.
    """
    candidates = list_candidate_models(verdict, law)
    if len(candidates) < 2:
        return None
    confirms = len(verdict.effects) == 1 and not verdict.laws
    tested = Tested.of_campaign(campaign, arrangement.train.predictor.sweeps, held_out=confirms)
    tests = list_tests(tested, candidates[0].model, find_peak(arrangement, tested))
    if confirms:
        tests = _hold_out(tests, campaign)
    return rank_tests(candidates, tests, find_error_sources(campaign, arrangement, verdict.model_error_size))


def find_error_sources(campaign: Campaign, arrangement: Arrangement, model_error: ErrorSize) -> ErrorSources:
    """Errors of further readings, taken from those of a campaign."""
    train = arrangement.train
    return ErrorSources(
        jitter=arrangement.jitter_of_one_repeat, budget=arrangement.budget,
        noise=PlannedNoise.of_campaign(train), model_error=model_error,
        unphased=frozenset(train.features.points.sensor[~train.observed.phased].tolist()),
        quantity=next((item.quantity for item in campaign.sensors if item.line is None), "displacement"),
    )  # fmt: skip


def rank_tests(candidates: Sequence[CandidateModel], tests: Sequence[NextTest], sources: ErrorSources) -> Advice | None:
    """Rank tests by their decision probability; among tests of nearly equal probability the shortest is advised.

    Returns
    -------
    The advice; None if the candidates cannot be predicted in any test.
    """
    probabilities = np.array([item.probability for item in candidates])
    ranked: list[RankedTest] = []
    result = {}
    for set_up in dict.fromkeys(test.set_up for test in tests):
        own = [test for test in tests if test.set_up == set_up]
        try:
            result[set_up] = SetUpSignatures.predict(candidates, own, sources)
        except ModelError:
            continue  # with this mass or preload a candidate is not supported
        for test in own:
            separation = result[set_up].separate(test)
            probability = compute_decision_probability(separation, probabilities)
            ranked.append(RankedTest(test=test, separation=separation, probability=probability))
    if not ranked:
        return None
    best = choose_test(ranked)
    rest = sorted((item for item in ranked if item is not best), key=lambda item: -item.probability)
    best = replace(best, curve=result[best.test.set_up].take_curve(best.test))
    return Advice(
        names=tuple(item.name for item in candidates), probabilities=tuple(probabilities.tolist()),
        ranked=(best, *rest),
    )  # fmt: skip


def choose_test(ranked: Sequence[RankedTest]) -> RankedTest:
    """The shortest test among those with nearly the largest decision probability."""
    most = max(item.probability for item in ranked)
    near = [item for item in ranked if item.probability >= most - SAME_PROBABILITY]
    return min(near, key=lambda item: (item.test.minutes, -_find_least(item.separation)))


def _find_least(separation: Float[NDArray[np.float64], "n n"]) -> float:
    """Smallest separation d^2 of all pairs."""
    return float(separation[np.triu_indices(len(separation), 1)].min())


def _hold_out(tests: Sequence[NextTest], campaign: Campaign) -> list[NextTest]:
    """Tests that can be held out: those at held-out levels, if levels are held out; any test if repeats are."""
    levels = set(campaign.held_out.levels)
    able = [item for item in tests if not levels or campaign.held_out.repeats or levels.issuperset(item.levels)]
    return [replace(item, is_held_out=True) for item in able]


def find_peak(arrangement: Arrangement, tested: Tested) -> Float[NDArray[np.float64], " n"]:
    """Largest measured motion at each frequency at the highest level, shape (n,)."""
    observed = arrangement.train.observed
    points = observed.points
    own = observed.motion & (points.harmonic == 1) & (points.free == (tested.configuration == "free"))
    own &= points.level == points.level[own].max(initial=0.0)
    peak = np.zeros(len(tested.frequencies))
    for number, frequency in enumerate(tested.frequencies):
        at = own & np.isclose(points.frequency, frequency, rtol=1e-9)
        peak[number] = np.abs(observed.value[at]).max(initial=0.0)
    return peak
