"""One of the score's specimens, at few points: made on the bench, diagnosed among few candidates, put on record.

How often a diagnosis is right, with and without a hidden effect, is scored by `benchmarks.hidden_effects`.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchmarks.hidden_effects_campaign import examine
from benchmarks.hidden_effects_groups import read_groups
from benchmarks.hidden_effects_plan import Case
from benchmarks.hidden_effects_record import AMBIGUOUS
from correlation.campaign.measurement import Campaign
from correlation.model import Model
from diagnosis.diagnose import Diagnosis, diagnose
from diagnosis.effect import EFFECTS
from tests.slow import slow
from transient.virtual_bench.campaign import CampaignPoints
from transient.virtual_bench.hidden_effect import HiddenEffectRecord, make_campaign

#: Three levels, the middle one held out, and six and four of the frequencies.
POINTS = CampaignPoints(
    levels=(1.0, 5.0, 10.0),
    frequencies=CampaignPoints().frequencies[2::4],
    free_frequencies=CampaignPoints().free_frequencies[3::6],
    n_repeat=4,
)


def make(folder: Path, *, seed: int, kind: str) -> HiddenEffectRecord:
    return make_campaign(folder, seed=seed, kind=kind, points=POINTS)


def judge(campaign: Campaign, base: Model, parameters: Any, budget: Any, **options: Any) -> Diagnosis:
    """Among the cubic springs of all places, by four harmonics of the coarse mesh alone."""
    options["without"] = [name for name in EFFECTS.names() if name != "cubic"]
    quick = replace(base, n_harmonic=4, n_sample=64)
    return diagnose(campaign, quick, parameters, replace(budget, refined=()), **options)


@slow
def test_a_campaign_of_the_score_is_judged_as_it_should_be(tmp_path: Path) -> None:
    record = examine(Case(row="cubic", seed=72005), tmp_path, read_groups(), make=make, judge=judge)
    # So few points do not tell it from a spring beyond a clearance.
    assert (record.failure, record.finding, record.names) == ("", AMBIGUOUS, ("cubic at tip",))
    assert record.planted.effect == "cubic at tip"
    # More than one place was fitted.
    assert len(record.ranking) > 1
    named = record.named[0]
    assert named.strength == pytest.approx(record.planted.value, abs=4 * named.deviation)
