"""Advice on the next test in the report, on the page and in the document of a diagnosis."""

import json
from base64 import b64decode
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from diagnosis.decision.verdict import Finding
from diagnosis.next_test.advise import Advice, RankedTest
from diagnosis.next_test.next_test import NextTest
from diagnosis.next_test.signature import SignatureCurve
from hbsolve.errors import ModelError, NoSteadyState
from pipeline.store import Store
from study.bench.view.finding import show_next_tests
from study.diagnose import next_test
from study.diagnose.document import make_document
from study.diagnose.next_test import NextStep, find_next_step
from study.diagnose.page import make_files
from study.diagnose.report import format_report
from study.diagnose.run import DiagnosisResult, diagnose_file
from study.json_value import to_json
from study.run_context import silent_run

TwoMasses = Callable[..., Path]
FREQUENCIES = (20.0, 20.5, 21.0)


@pytest.fixture
def diagnosed(two_masses: TwoMasses, kept_rounds: Store) -> DiagnosisResult:
    case, folder = two_masses({"mass at tip": 0.006}), Path("campaign")
    return diagnose_file(case, read_campaign(folder), folder, replace(silent_run(), store=kept_rounds))


def make_advice(*probabilities: float) -> Advice:
    base = NextTest(
        name="the same tests again", configuration="jointed", levels=(2.0,), frequencies=FREQUENCIES, sensors=("tip",)
    )
    tests = [
        replace(base, name="a mass of 3 g added at tip", added_mass=("tip", 3e-3)), replace(base, place="base"), base,
    ]  # fmt: skip
    curve = SignatureCurve(
        sensor="tip", level=2.0, harmonic=1, frequency=np.array(FREQUENCIES),
        value=1e-6 * np.array([[1.0, 2.0, 1.0], [1.0, 1.0, 2.0]], dtype=complex), deviation=np.full(3, 1e-8),
    )  # fmt: skip
    ranked = [
        RankedTest(test=test, separation=np.array([[0.0, 9.0], [9.0, 0.0]]), probability=share)
        for test, share in zip(tests, probabilities, strict=True)
    ]
    return Advice(
        names=("mass at tip", "density of all"), probabilities=(0.6, 0.4),
        ranked=(replace(ranked[0], curve=curve), *ranked[1:]),
    )  # fmt: skip


def test_advice_stands_in_the_report_on_the_page_and_in_the_document(diagnosed: DiagnosisResult) -> None:
    advice = make_advice(0.93, 0.5, 0.1)
    several = replace(diagnosed.last.diagnosis.verdict, finding=Finding.AMBIGUOUS)
    result = replace(
        diagnosed.last, next_step=NextStep(advice=advice), diagnosis=replace(diagnosed.last.diagnosis, verdict=several)
    )
    assert "a mass of 3 g added at tip" in result.next_step.sentence
    assert "93 %" in result.next_step.sentence
    assert result.next_step.sentence in format_report(result)
    assert result.next_step.remark in format_report(result)  # another mass needs a case of its own
    files = make_files(result, diagnosed.history, Path("chain.toml"))
    assert files["chain_diagnosis_next_test.png"].startswith(b"\x89PNG")
    page = files["chain_diagnosis.html"].decode()
    assert "What to measure next" in page
    assert "a mass of 3 g added at tip" in page
    shown = show_next_tests(result)
    assert shown is not None
    assert [row["probability"] for row in shown["rows"]] == [item.probability for item in result.next_step.shown]
    assert b64decode(shown["picture"]).startswith(b"\x89PNG")
    assert show_next_tests(diagnosed.last) is None
    told = json.loads(json.dumps(to_json(make_document(result))))["next_test"]
    assert told["candidates"] == {"mass at tip": 0.6, "density of all": 0.4}
    assert told["tests"][0]["probability"] == 0.93
    assert told["tests"][0]["added_mass"] == {"place": "tip", "mass_kg": 3e-3}
    assert told["tests"][0]["separation"] == {"mass at tip | density of all": 9.0}
    assert told["tests"][1]["further_sensor_at"] == "base"


def test_a_further_sensor_is_shown_where_it_tells_more(diagnosed: DiagnosisResult) -> None:
    assert diagnosed.last.next_step.advice is None  # one effect is named alone: nothing is to be separated
    titles = [item.test.title for item in NextStep(advice=make_advice(0.93, 0.5, 0.1)).shown]
    assert titles[1] == "the same tests again, and a further sensor at base"
    titles = [item.test.title for item in NextStep(advice=make_advice(0.93, 0.5, 0.5)).shown]
    assert titles[1:] == ["the same tests again"]


def test_a_test_that_hardly_decides_is_not_said_to_decide() -> None:
    assert "30 %" in NextStep(advice=make_advice(0.3, 0.2, 0.1)).sentence
    assert "that decides" not in NextStep(advice=make_advice(0.3, 0.2, 0.1)).sentence
    assert NextStep(advice=make_advice(1e-4, 1e-5, 0.0)).sentence.startswith("none of the further tests")


def test_what_fails_leaves_one_sentence_and_the_diagnosis(
    diagnosed: DiagnosisResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    error: Exception = ModelError("the structure is not supported")

    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(next_test, "advise", fail)
    result = diagnosed.last
    step = find_next_step(result.campaign, result.diagnosis, None)
    assert step.advice is None
    assert "the structure is not supported" in step.reason
    assert step.reason in format_report(replace(result, next_step=step))
    assert step.reason in str(make_document(replace(result, next_step=step))["next_test"])
    error = NoSteadyState("at 20 Hz")
    assert "at 20 Hz" in find_next_step(result.campaign, result.diagnosis, None).reason
    error = ValueError("operands could not be broadcast together")
    with pytest.raises(ValueError, match="broadcast"):  # a mistake of the program is none of the model
        find_next_step(result.campaign, result.diagnosis, None)


def test_where_no_motion_stands_out_the_test_is_told_that_shows_most(two_masses: TwoMasses) -> None:
    """Noise of half the largest motion: some effects would show at twice the highest level."""
    case, folder = two_masses({"mass at tip": 0.006}), Path("campaign")
    campaign = read_campaign(folder)
    table, random = campaign.measurement, np.random.default_rng(1)
    noise = 0.5 * np.abs(table.value).max() * random.standard_normal((2, len(table)))
    drowned = replace(campaign, measurement=replace(table, value=table.value + noise[0] + 1j * noise[1]))
    result = diagnose_file(case, drowned, folder, silent_run())
    assert result.last.diagnosis.verdict.finding is Finding.NOT_TESTABLE
    words = format_report(result.last)
    assert "cannot show whether an effect is missing: no motion exceeds its scatter" in words
    step = result.last.next_step
    assert step.visible is not None
    assert "measure a higher level" in step.sentence
    assert step.sentence in words
    assert make_document(result.last)["next_test"]["would_show"] == [*step.visible.seen]
