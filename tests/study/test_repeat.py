"""`stickslip repeat`: what a page says that it was made by makes the same numbers again."""

import html
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study import cli
from study.provenance import list_result_words
from study.repeat.source import RUN, keep_results, read_result
from tests.slow import slow
from tests.study.test_runs import CASE

TwoMasses = Callable[..., Path]


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """No pictures, which take longer than these results."""
    monkeypatch.setattr("study.run_context.RunContext.draw", lambda *_: [])
    monkeypatch.setattr("study.solve.run._list_results", lambda *_: {})


@pytest.fixture
def solved(at_home: Path, undrawn: None) -> Path:
    """Folder of the results of a mass on a spring."""
    (at_home / "case").mkdir()
    np.savez(at_home / "case" / "one.npz", M=np.eye(1), K=1e4 * np.eye(1))
    (at_home / "case" / "one.toml").write_text(CASE.format(damping=1))
    assert cli.main(["solve", "case/one.toml", "--out", "solved", "--quiet"]) == 0
    return at_home / "solved"


def answer(capfd: pytest.CaptureFixture[str], *words: str, code: int = 0) -> dict[str, Any]:
    capfd.readouterr()
    assert cli.main(["repeat", *words, "--json"]) == code
    document: dict[str, Any] = json.loads(capfd.readouterr().out)
    return document


def provenance(page: Path) -> dict[str, Any]:
    result = RUN.search(page.read_text(encoding="utf-8"))
    assert result is not None
    document: dict[str, Any] = json.loads(html.unescape(result[1]))
    return document


def test_a_run_is_repeated_from_its_record_with_the_same_numbers(
    solved: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    result = answer(capfd, "solved", "--out", "again")
    assert (result["same"], result["changes"], result["different"]) == (True, [], [])
    assert result["command"] == ["solve", "case/one.toml"]
    assert result["compared"] > 5
    assert (solved.parent / "again" / "one_response.csv").read_bytes() == (solved / "one_response.csv").read_bytes()
    # A copy of what was read stays, nothing that was stored on the way.
    assert {file.name for file in (solved.parent / "again" / "input").rglob("*.*")} == {"one.npz", "one.toml"}
    assert not list((solved.parent / "again").glob(".*"))


def test_changed_data_are_named_before_their_numbers_differ(solved: Path, capfd: pytest.CaptureFixture[str]) -> None:
    np.savez(solved.parent / "case" / "one.npz", M=np.eye(1), K=1.1e4 * np.eye(1))
    assert cli.main(["repeat", "solved", "--out", "again", "--quiet"]) == 1
    told = capfd.readouterr()
    assert "case/one.npz has changed since" in told.err
    assert "case/one.toml" not in told.err
    assert "the numbers are not the same" in told.out


def test_a_missing_file_is_asked_for_and_found_in_another_folder(
    solved: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (solved.parent / "moved").mkdir()
    (solved.parent / "case").rename(solved.parent / "moved" / "case")
    assert cli.main(["repeat", "solved", "--out", "again"]) == 2
    told = capfd.readouterr().err
    assert "case/one.toml" in told
    assert "--folder" in told
    assert answer(capfd, "solved", "--out", "again", "--folder", "moved")["same"]


@slow
def test_a_page_is_repeated_without_a_record_and_leaves_the_history_alone(
    two_masses: TwoMasses, capfd: pytest.CaptureFixture[str]
) -> None:
    case = two_masses({"mass at tip": 0.006})
    words = ["diagnose", case.name, "campaign", "--without", "spring", "dashpot", "cubic", "--out", "out", "--quiet"]
    assert cli.main(words) == 0
    (page,) = Path("out").glob("*.html")
    known = provenance(page)
    assert known["command"] == words[:-3]
    assert {"chain.toml", "chain.npz", "campaign"} == set(known["inputs"])
    assert known["folder"] == ".."
    history = Path("chain.history.json").read_bytes()
    before = Path("chain.history.json").stat().st_mtime_ns
    result = answer(capfd, str(page), "--out", "again", "--cache", "another")
    assert (result["same"], result["changes"], result["different"]) == (True, [], [])
    assert result["compared"] > 500
    assert (Path("chain.history.json").read_bytes(), Path("chain.history.json").stat().st_mtime_ns) == (history, before)
    # Another number in the data of the page is noticed.
    text = page.read_text(encoding="utf-8")
    (number,) = re.findall(r"\d\.\d{6,}", text[text.index("const DATA") :])[:1]
    page.write_text(text.replace(number, f"{float(number) + 0.5}", 1), encoding="utf-8")
    changed = read_result(page, Path("another")).values
    assert changed != read_result(Path("again") / page.name, Path("another")).values


def test_what_a_result_took_and_when_is_no_part_of_it(tmp_path: Path) -> None:
    assert keep_results({"rows": [{"seconds": 1.0, "peak": 2.0}], "files": ["a"]}) == {"rows": [{"peak": 2.0}]}
    made_by = {"command": ["table1"], "folder": ".", "inputs": {}, "versions": {}}
    for name, took, when in (("a.html", "1.0", "2026-11-27 17:45"), ("b.html", "2.0", "2026-11-27 17:46")):
        text = f'<table><tr><td>125.1</td><td class="cost">{took}</td><td>{when}</td></tr></table>'
        (tmp_path / name).write_text(HOSTILE.format(html.escape(json.dumps(made_by))) + text)
    first, second = (read_result(tmp_path / name, tmp_path).values for name in ("a.html", "b.html"))
    assert first == second == {"data": {}, "text": ["125.1"]}


HOSTILE = '<meta name="stickslip-run" content="{}">'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<p>Nothing.</p>", "does not contain the command"),
        (HOSTILE.format("{"), "damaged"),
        (HOSTILE.format(html.escape('{"command": [1], "folder": "", "inputs": {}, "versions": {}}')), "damaged"),
        (HOSTILE.format("[" * 100_000), "damaged"),
        (HOSTILE.format(html.escape('{"command": ["cache", "--clear"], "folder": "", "inputs": {}, "versions": {}}')),
         "which changes your files"),
    ],
)  # fmt: skip
def test_a_page_that_cannot_be_repeated_is_one_sentence(
    at_home: Path, capfd: pytest.CaptureFixture[str], text: str, message: str
) -> None:
    (at_home / "page.html").write_text(text)
    assert cli.main(["repeat", "page.html", "--out", "again"]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert message in line


def test_code_of_others_is_not_copied_into_ones_own(at_home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (at_home / "law.py").write_text("raise SystemExit")
    (at_home / "law.py").chmod(0o666)
    made_by = {"command": ["solve", "--figures", "law.py"], "folder": ".", "inputs": {}, "versions": {}}
    (at_home / "page.html").write_text(HOSTILE.format(html.escape(json.dumps(made_by))))
    assert cli.main(["repeat", "page.html", "--out", "again"]) == 2
    assert "--trust" in capfd.readouterr().err


def test_the_folder_of_the_result_is_not_written_again(solved: Path) -> None:
    before = {file.name: file.stat().st_mtime_ns for file in solved.iterdir()}
    assert cli.main(["repeat", "solved", "--out", "solved"]) == 2
    assert {file.name: file.stat().st_mtime_ns for file in solved.iterdir()} == before


def test_where_a_result_goes_is_no_part_of_what_it_is() -> None:
    words = ["sweep", "a.toml", "mu=1", "--out", "b", "--json", "--cache=c", "--scheduler", "tcp://x:1", "--limits"]
    assert list_result_words(words) == ["sweep", "a.toml", "mu=1", "--limits"]
