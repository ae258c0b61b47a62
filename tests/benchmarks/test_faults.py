"""Faults: the benchmark sees lost, other and repeated work, and codes that no fault may end with."""

import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

from benchmarks.faults import COMMANDS, Bench, _content, _ends_well, _make_older
from pipeline.record import DamagedRecord, Record, is_intact, read_record, write_record

ROOT = Path(__file__).parents[2]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    """A command that writes one result and stores one, without running anything."""
    made = object.__new__(Bench)
    made.name, made.command, made.folder = "solve", COMMANDS["solve"], tmp_path
    made.cache, made.out, made.seconds = tmp_path / "cache", tmp_path / "out", 1.0
    (made.cache / "objects").mkdir(parents=True)
    made.out.mkdir()
    (made.out / "a.csv").write_text("1")
    (made.cache / "objects" / "a.npz").write_text("1")
    made.wanted = made.digests()
    return made


def ending(bench: Bench, monkeypatch: pytest.MonkeyPatch, code: int = 0, errors: str = "", write: str = "") -> str:
    def run(**_: object) -> "subprocess.CompletedProcess[str]":
        if write:
            (bench.folder / write).write_text("2")
        return subprocess.CompletedProcess((), code, "", errors)

    monkeypatch.setattr(bench, "run", run)
    before = {file: 0 if "cache" in write else when for file, when in bench.stored().items()}
    return bench.judge(before)


def test_what_is_lost_or_done_again_is_told(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    assert ending(bench, monkeypatch) == ""
    assert "computed again" in ending(bench, monkeypatch, write="cache/objects/a.npz")
    assert "other files: a.csv" in ending(bench, monkeypatch, write="out/a.csv")
    bench.wanted = bench.digests()
    assert "ends with 70" in ending(bench, monkeypatch, code=70)
    assert ending(bench, monkeypatch, errors="Traceback (most recent call last)")


def test_an_end_that_no_fault_explains_is_told() -> None:
    assert _ends_well(3, "interrupted", {3}) == ""
    assert _ends_well(1, "", {3})
    assert _ends_well(3, "Traceback", {3})
    assert _ends_well(2, "internal error of stickslip", {2})


def test_times_of_writing_do_not_count(tmp_path: Path) -> None:
    contents = []
    for when in ("2026-01-01T00:00:00", "2026-01-02T03:04:05"):
        (tmp_path / "a.step").write_text(f"FILE_NAME('a','{when}')")
        contents.append(_content(tmp_path / "a.step"))
    assert contents[0] == contents[1]


def test_an_older_record_has_a_sound_checksum_and_a_class_that_there_is_no_more(tmp_path: Path) -> None:
    from reduction.joint_law.jenkins import JenkinsElement

    slider = JenkinsElement(name="pad", direction=np.ones(1), tangential_stiffness=1.0, limit_force=1.0)
    write_record(tmp_path / "a.npz", Record(value=slider))
    _make_older(tmp_path / "a.npz")
    assert is_intact(tmp_path / "a.npz")
    assert zipfile.is_zipfile(tmp_path / "a.npz")
    with pytest.raises(DamagedRecord, match="gone"):
        read_record(tmp_path / "a.npz")


def test_the_changed_lines_stand_in_the_shipped_cases() -> None:
    import re

    for command in COMMANDS.values():
        for file, changes in command.changes.items():
            text = (ROOT / "study" / "cases" / file).read_text(encoding="utf-8")
            assert all(re.search(old, text) for old, _ in changes)
