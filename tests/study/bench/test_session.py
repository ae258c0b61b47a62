"""A session: clicks become calls one after another, what others change is noticed, and nothing is lost."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from study.bench.session import Session
from study.bench.work import BenchFiles


class FakeWorker:
    """Notes calls; the test answers them."""

    def __init__(self) -> None:
        self.calls: list[tuple[int, str, dict[str, Any]]] = []
        self.ended = 0

    def call(self, number: int, name: str, arguments: Mapping[str, Any]) -> None:
        self.calls.append((number, name, dict(arguments)))

    def end(self) -> None:
        self.ended += 1


Opened = tuple[Session, FakeWorker, Path]


@pytest.fixture
def opened(tmp_path: Path) -> Opened:
    """A session that has shown the case: comparison and screening are there."""
    case, folder = tmp_path / "case.toml", tmp_path / "campaign"
    case.write_text("schema = 2\n", encoding="utf-8")
    folder.mkdir()
    (folder / "campaign.toml").write_text("schema = 1\n", encoding="utf-8")
    worker = FakeWorker()
    session = Session(place=BenchFiles(case=case, folder=folder), worker=worker)
    session.begin()
    answer(session, worker)
    answer(session, worker, is_diagnosed=False)
    return session, worker, case


def answer(session: Session, worker: FakeWorker, numbers: Mapping[str, float] | None = None, **views: Any) -> None:
    """Answer the call that runs."""
    number, name, arguments = worker.calls[-1]
    session.receive(
        {
            "kind": "done",
            "number": number,
            "name": name,
            "arguments": arguments,
            "numbers": numbers or {},
            "views": views,
        }
    )


def names(worker: FakeWorker) -> list[str]:
    return [name for _, name, _ in worker.calls]


def test_calls_run_one_after_another(opened: Opened) -> None:
    session, worker, _ = opened
    assert names(worker) == ["compare", "screen"]
    session.ask("diagnose", {})
    session.ask("move", {"values": {"kt": 1.1}})
    session.ask("move", {"values": {"kt": 1.2}})
    assert names(worker)[2:] == ["diagnose"]
    answer(session, worker)
    # Of a slider that is dragged the last place counts.
    assert worker.calls[-1][1:] == ("move", {"values": {"kt": 1.2}})


def test_a_stored_diagnosis_follows_its_screening(opened: Opened) -> None:
    session, worker, _ = opened
    session.ask("screen", {})
    answer(session, worker, is_diagnosed=True)
    assert names(worker)[-1] == "diagnose"


def test_the_case_is_not_written_while_something_computes(opened: Opened) -> None:
    session, worker, _ = opened
    session.ask("diagnose", {})
    session.ask("add", {"effect": "mass at tip"})
    assert names(worker)[2:] == ["diagnose"]
    assert session.message is not None
    assert session.message["tone"] == "error"
    assert session.queue == []


def test_what_was_written_is_compared_and_screened_anew(opened: Opened) -> None:
    session, worker, case = opened
    session.ask("add", {"effect": "mass at tip"})
    case.write_text("schema = 2\n[[added]]\n", encoding="utf-8")
    session.check_for_changes()
    answer(session, worker)
    session.check_for_changes()
    # Its own change is nobody's edit.
    assert [entry.name for entry in session.entries] == ["compare", "screen", "add"]
    assert names(worker)[-1] == "compare"
    assert [call.name for call in session.queue] == ["screen"]


def test_an_edit_by_hand_is_told_noted_and_shown(opened: Opened) -> None:
    session, worker, case = opened
    case.write_text("schema = 2 # mine\n", encoding="utf-8")
    session.check_for_changes()
    assert session.message is not None
    assert "case.toml" in session.message["text"]
    assert session.entries[-1].arguments == {"text": "schema = 2 # mine\n"}
    assert names(worker)[-1] == "compare"


def test_an_answer_for_the_case_before_an_edit_is_not_shown(opened: Opened) -> None:
    session, worker, case = opened
    session.ask("diagnose", {})
    case.write_text("schema = 2 # mine\n", encoding="utf-8")
    session.check_for_changes()
    answer(session, worker, candidates={"rows": []})
    assert "candidates" not in session.views
    assert names(worker)[-1] == "compare"


def test_a_campaign_that_was_replaced_is_read_anew(opened: Opened) -> None:
    session, worker, case = opened
    (case.parent / "campaign" / "campaign.toml").write_text("schema = 1\ntitle = 'new'\n", encoding="utf-8")
    session.check_for_changes()
    assert session.message is not None
    assert "campaign" in session.message["text"]
    assert names(worker)[-1] == "compare"


def test_a_case_that_is_missing_for_a_moment_is_waited_for(opened: Opened) -> None:
    session, worker, case = opened
    text = case.read_text(encoding="utf-8")
    case.unlink()
    session.check_for_changes()
    case.write_text(text, encoding="utf-8")
    session.check_for_changes()
    assert names(worker) == ["compare", "screen"]


def test_cancel_ends_the_worker_and_late_answers_count_for_nothing(opened: Opened) -> None:
    session, worker, _ = opened
    session.ask("diagnose", {})
    session.cancel()
    assert worker.ended == 1
    assert session.state["busy"] is None
    number, name, arguments = worker.calls[-1]
    session.ask("screen", {})
    late = {"kind": "done", "number": number, "name": name, "arguments": arguments, "numbers": {}}
    session.receive({**late, "views": {"candidates": {"rows": []}}})
    assert "candidates" not in session.views
    assert session.state["busy"]["name"] == "screen"


def test_a_failure_is_a_sentence_and_the_session_goes_on(opened: Opened) -> None:
    session, worker, _ = opened
    session.ask("diagnose", {})
    number, name, arguments = worker.calls[-1]
    session.receive({"kind": "failed", "number": number, "name": name, "arguments": arguments, "sentence": "No."})
    assert session.message == {"tone": "error", "text": "No.", "of": "diagnose"}
    session.ask("compare", {})
    assert names(worker)[-1] == "compare"


def test_a_worker_that_dies_is_a_sentence_and_the_next_click_works(opened: Opened) -> None:
    session, worker, _ = opened
    session.ask("diagnose", {})
    session.receive({"kind": "ended"})
    assert session.message is not None
    assert session.state["busy"] is None
    session.ask("diagnose", {})
    assert names(worker)[-2:] == ["diagnose", "diagnose"]


def test_every_new_state_has_a_higher_revision(opened: Opened) -> None:
    session, _, _ = opened
    seen = session.revision
    session.ask("diagnose", {})
    session.receive({"kind": "progress", "steps": [{"name": "calibration", "share": 0.5}]})
    assert session.revision > seen + 1
    assert session.state["steps"] == [{"name": "calibration", "share": 0.5}]


def test_an_unknown_call_is_refused(opened: Opened) -> None:
    session, worker, _ = opened
    session.ask("_compare", {})
    assert names(worker) == ["compare", "screen"]
    assert session.message is not None


def test_the_next_session_shows_what_the_last_did_until_it_has_compared_anew(tmp_path: Path, opened: Opened) -> None:
    _, _, case = opened
    place = BenchFiles(case=case, folder=case.parent / "campaign", cache=tmp_path / "cache")

    def begin() -> tuple[Session, FakeWorker]:
        worker = FakeWorker()
        session = Session(place=place, worker=worker)
        session.begin()
        return session, worker

    session, worker = begin()
    assert not session.views
    answer(session, worker, verdict={"tag": "ü"})
    answer(session, worker, candidates={"rows": []}, is_diagnosed=False)
    session.ask("move", {"values": {"kt": 1.1}})
    answer(session, worker, moved={})
    session, worker = begin()
    assert {name: json.loads(view) for name, (_, view) in session.views.items() if name != "is_diagnosed"} == {
        "verdict": {"tag": "ü"},
        "candidates": {"rows": []},
    }
    assert session.state["is_last"]
    answer(session, worker, verdict={"tag": "now"})
    answer(session, worker, is_diagnosed=False)
    assert not session.state["is_last"]
    case.write_text("schema = 2 # mine\n", encoding="utf-8")
    assert not begin()[0].views
    for file in (tmp_path / "cache" / "bench").iterdir():
        file.write_bytes(file.read_bytes()[:-9])
    case.write_text("schema = 2\n", encoding="utf-8")
    assert not begin()[0].views


def test_limits_of_a_case_that_has_changed_are_taken_off_the_page(opened: Opened) -> None:
    session, worker, case = opened
    session.ask("limits", {})
    answer(session, worker, limits={"panels": []})
    before = session.state["versions"]["limits"]
    case.write_text("schema = 2 # mine\n", encoding="utf-8")
    session.check_for_changes()
    answer(session, worker)
    assert session.views["limits"] == (before + 1, b"null")


def test_a_script_holds_an_effect_file_as_it_was_before_it_was_first_saved(opened: Opened) -> None:
    session, worker, _ = opened
    session.ask("compare", {})
    answer(session, worker, own={"files": [{"name": "own.py", "text": "first"}]})
    for text in ("second", "third"):
        session.ask("save_effect", {"file": "own.py", "text": text})
        answer(session, worker, own={"files": [{"name": "own.py", "text": text}]})
        answer(session, worker)
        answer(session, worker, is_diagnosed=False)
    session.ask("save_effect", {"file": "new.py", "text": "new"})
    answer(session, worker)
    assert "EFFECTS = {'own.py': 'first'}\n" in session.script
    assert session.script.count("bench.save_effect(") == 3
