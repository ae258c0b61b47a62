"""Advice where a recovered law may be at several places."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.noise.error_size import NO_ERROR
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.refit import make_baseline_refit
from diagnosis.missing_law.place_law import MissingLaw
from diagnosis.next_test.advise import advise, find_error_sources, rank_tests
from diagnosis.next_test.candidate_model import list_candidate_models
from diagnosis.next_test.next_test import NextTest
from tests.diagnosis.missing_law.chain import FREQUENCIES, make_chain, measure, play
from tests.slow import slow


@pytest.fixture(scope="module")
def unknown(chain_with_play: Arrangement) -> Verdict:
    before = make_baseline_refit(chain_with_play)
    return Verdict(finding=Finding.UNKNOWN, effects=[], baseline=before, detectable={}, units={})


@pytest.fixture(scope="module")
def doubtful(recovered_play: MissingLaw) -> MissingLaw:
    """The law with two places that are as probable."""
    names = tuple(law.name for law in recovered_play.places[:2])
    shares = np.array([0.5, 0.5, *np.zeros(len(recovered_play.places) - 2)])
    return replace(recovered_play, credible=names, probability=shares)


@slow
def test_the_model_with_a_law_explains_what_the_law_was_recovered_from(
    chain_with_play: Arrangement, unknown: Verdict, doubtful: MissingLaw
) -> None:
    candidates = list_candidate_models(unknown, doubtful)
    assert [item.name for item in candidates] == [f"a law at {name}" for name in doubtful.credible]
    train = chain_with_play.train
    misfits = [float(np.mean(train.residual(train.predict(item.model)) ** 2)) for item in candidates]
    alone = float(np.mean(train.residual(chain_with_play.fit.prediction) ** 2))
    # The play is at the first of both; noise alone is 1, and a law of straight pieces adds some.
    assert misfits[0] < min(5, 0.1 * alone)


@slow
def test_the_same_tests_tell_between_places_that_they_told_between_already(
    chain_with_play: Arrangement, unknown: Verdict, doubtful: MissingLaw
) -> None:
    campaign, candidates = measure(make_chain(), play(), (1, 3)), list_candidate_models(unknown, doubtful)
    again = NextTest(
        name="again", configuration="jointed", levels=(0.2, 0.4), frequencies=tuple(FREQUENCIES[::2].tolist()),
        sensors=tuple(item.name for item in campaign.sensors), sweeps=(1,),
    )  # fmt: skip
    advice = rank_tests(candidates, [again], find_error_sources(campaign, chain_with_play, NO_ERROR))
    assert advice is not None
    # The evidence of both places differs by tens: tests of half the size tell as well.
    assert advice.best.probability > 0.9


@slow
def test_one_place_leaves_nothing_to_separate(
    chain_with_play: Arrangement, unknown: Verdict, recovered_play: MissingLaw
) -> None:
    assert len(recovered_play.credible) == 1
    assert advise(measure(make_chain(), play(), (1, 3)), chain_with_play, unknown, recovered_play) is None
