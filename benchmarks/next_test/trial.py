"""Trial of one stranger: its first diagnosis, and the diagnoses after the advised test and after a random one."""

import tempfile
import time
import traceback
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.next_test.simulate import ENTROPY, simulate
from benchmarks.processor_time import TimeUp, limited
from benchmarks.strangers.campaign import Stranger, make
from benchmarks.strangers.trial import describe_round
from correlation.campaign.join_campaigns import join_campaigns
from correlation.campaign.measurement import Campaign, HeldOut
from correlation.campaign.read_campaign import read_campaign
from diagnosis.decision.verdict import Finding
from diagnosis.next_test.advise import RankedTest, choose_test
from study.case.setup import read_case
from study.diagnose.round import Round, diagnose_case

#: Largest processor time of one diagnosis [s].
LIMIT = 300.0


def run(seed: int) -> Mapping[str, Any]:
    """Make the record of a seed; an exception becomes its "failure"."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        record: dict[str, Any] = {"seed": seed}
        try:
            stranger = make(seed, folder)
            record |= {"effects": stranger.truth["effects"], "structure": stranger.truth["structure"]}
            campaign = read_campaign(stranger.folder)
            with limited(LIMIT):
                first = _diagnose(stranger, campaign)
            record["first"] = describe_round(first.diagnosis, stranger.hidden)
            advice = first.next_step.advice
            if first.diagnosis.verdict.finding is not Finding.AMBIGUOUS or advice is None:
                return {**record, "reason": first.next_step.reason}
            record |= {"candidates": [*advice.names], "probabilities": [*advice.probabilities]}
            able = [item for item in advice.ranked if item.test.fits_campaign]
            best = choose_test(able)
            random = np.random.default_rng(np.random.SeedSequence([ENTROPY, seed, 1]))
            others = [item for item in able if item is not best and item.test.minutes <= best.test.minutes]
            chosen = {"advised": best}
            if others:
                chosen["random"] = others[int(random.integers(len(others)))]
            for name, ranked in chosen.items():
                record[name] = _measure_and_diagnose(stranger, campaign, ranked)
        except TimeUp as end:
            record["failure"] = str(end)
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            record["failure"] = f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"[
                :500
            ]
        return record


def _diagnose(stranger: Stranger, campaign: Campaign) -> Round:
    return diagnose_case(read_case(stranger.case, campaign).setup, campaign)


def _measure_and_diagnose(stranger: Stranger, campaign: Campaign, ranked: RankedTest) -> dict[str, Any]:
    """Measure a further test and diagnose all data together."""
    begin, test = time.process_time(), ranked.test
    result: dict[str, Any] = {"test": test.title, "minutes": test.minutes, "expected": ranked.probability}
    try:
        further = simulate(stranger, test, stranger.truth["seed"])
        with limited(LIMIT):
            if test.is_held_out and campaign.held_out.repeats:
                further = replace(further, held_out=HeldOut(repeats=tuple(range(1, test.n_repeat + 1))))
            both = _diagnose(stranger, join_campaigns(campaign, replace(further, drive=campaign.drive)))
            result |= describe_round(both.diagnosis, stranger.hidden)
    except TimeUp as end:
        result |= {"finding": "failed", "failure": str(end)}
    return {**result, "seconds": time.process_time() - begin}
