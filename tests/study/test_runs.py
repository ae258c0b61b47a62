"""`stickslip runs`: a record of each run that writes files; listed, compared, and removed with what it wrote."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from study import cli
from study.run_record import RECORDS, find_records

CASE = """\
schema = 2
[structure]
kind = "plain"
file = "one.npz"
[structure.damping]
ratio = "{damping} %"
[[load]]
dof = 0
amplitude = "1 N"
[[sensor]]
name = "mass"
dof = 0
[sweep]
from = "15 Hz"
to = "17 Hz"
step = "0.1 Hz"
levels = [1]
[harmonics]
highest = 1
"""


@pytest.fixture
def two_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folders ``a`` and ``b`` of a mass on a spring with 1 and 2 % damping."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    # Figures take longer than these curves.
    monkeypatch.setattr("study.run_context.RunContext.draw", lambda *_: [])
    np.savez("one.npz", M=np.eye(1), K=1e4 * np.eye(1))
    for name, damping in (("a", 1), ("b", 2)):
        Path(f"{name}.toml").write_text(CASE.format(damping=damping))
        assert cli.main(["solve", f"{name}.toml", "--out", name, "--quiet"]) == 0
    return tmp_path


def answer(capfd: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    capfd.readouterr()
    assert cli.main([*words, "--json"]) == 0
    document = json.loads(capfd.readouterr().out)
    assert isinstance(document, dict)
    return document


def test_runs_are_listed_with_their_command_and_what_changed_since(
    two_runs: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    runs = answer(capfd, "runs")["runs"]
    assert isinstance(runs, list)
    assert [run["folder"] for run in runs] == ["a", "b"]
    assert [run["command"][:2] for run in runs] == [["solve", "a.toml"], ["solve", "b.toml"]]
    assert [run["inputs_changed"] for run in runs] == [[], []]
    Path("b.toml").write_text(CASE.format(damping=3))
    runs = answer(capfd, "runs")["runs"]
    assert isinstance(runs, list)
    assert [run["inputs_changed"] for run in runs] == [[], ["b.toml"]]
    assert answer(capfd, "runs", "b")["runs"] == runs[1:]


def test_the_same_command_in_the_same_folder_is_one_record(two_runs: Path) -> None:
    assert cli.main(["solve", "a.toml", "--out", "a", "--quiet"]) == 0
    assert len(find_records(two_runs / "cache", two_runs)) == 2


def test_two_runs_differ_by_what_the_damping_changes(two_runs: Path, capfd: pytest.CaptureFixture[str]) -> None:
    different = answer(capfd, "runs", "compare", "a", "b")["different"]
    assert isinstance(different, list)
    by_key = {item["key"]: item for item in different}
    peak = by_key["curves[0].peak_amplitude"]
    # Twice the damping, half the amplitude, but for the step of the frequency.
    assert peak["first"] / peak["second"] == pytest.approx(2.0, rel=0.02)
    assert answer(capfd, "runs", "compare", "a", "a")["different"] == []


def test_clean_removes_what_the_run_wrote_and_nothing_else(two_runs: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (two_runs / "a" / "mine.txt").write_text("mine")
    edited = two_runs / "a" / "a_response.csv"
    later = edited.stat().st_mtime + 60
    os.utime(edited, (later, later))
    before = sorted((two_runs / "a").iterdir())
    listed = answer(capfd, "runs", "clean", "a")
    assert sorted((two_runs / "a").iterdir()) == before
    assert answer(capfd, "runs", "clean", "a", "--yes")["files"] == listed["files"]
    assert {file.name for file in (two_runs / "a").iterdir()} == {"mine.txt", "a_response.csv"}
    assert answer(capfd, "runs", "clean", "b", "--yes")["kept"] == []
    assert not (two_runs / "b").exists()
    assert answer(capfd, "runs")["runs"] == []


def test_a_record_that_was_tampered_with_removes_nothing_outside_its_folder(two_runs: Path) -> None:
    (file,) = [
        item for item in (two_runs / "cache" / RECORDS).iterdir() if "/a" in json.loads(item.read_text())["output"]
    ]
    document = json.loads(file.read_text())
    file.write_text(json.dumps(document | {"files": ["../one.npz", "..", "a_response.csv"]}))
    assert cli.main(["runs", "clean", "a", "--yes"]) == 0
    assert (two_runs / "one.npz").is_file()


def test_a_damaged_record_is_left_out(two_runs: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for file in (two_runs / "cache" / RECORDS).iterdir():
        file.write_text(file.read_text()[:100])
    assert answer(capfd, "runs")["runs"] == []


@pytest.mark.parametrize("words", [["compare", "a", "nowhere"], ["clean", "nowhere"], ["clean"], ["nowhere"]])
def test_a_folder_without_a_run_is_one_sentence(
    two_runs: Path, capfd: pytest.CaptureFixture[str], words: list[str]
) -> None:
    capfd.readouterr()
    assert cli.main(["runs", *words]) == 2
    assert capfd.readouterr().err.count("\n") == 1


def test_bash_completes_commands_and_options(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert cli.main(["completion", "bash"]) == 0
    script = tmp_path / "completion"
    script.write_text(capfd.readouterr().out)
    for words, wanted in ((["stickslip", "diag"], "diagnose"), (["stickslip", "diagnose", "--tri"], "--trials")):
        typed = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}"
        ask = f"source {script}; {typed}; _stickslip; echo ${{COMPREPLY[@]}}"
        done = subprocess.run(["bash", "-c", ask], capture_output=True, text=True, check=True)
        assert wanted in done.stdout.split()
