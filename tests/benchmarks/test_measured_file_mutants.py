"""Damaged test files of all formats give the right data or one sentence: a part of the benchmark."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.measured_file_mutants import judge, mutate, run
from benchmarks.measured_file_samples import write_samples
from correlation.file.column import Column, MeasuredFile
from correlation.file.read_file import read_file


def test_damaged_files_are_right_or_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    outcomes = run(128, tmp_path)
    assert sum(outcomes.values()) == 128
    assert {outcome for _, outcome in outcomes} == {"right", "sentence"}, capsys.readouterr().out


def test_damage_is_the_same_for_the_same_seed() -> None:
    data = bytes(range(200))
    first, second = (mutate(data, np.random.default_rng([1, 2])) for _ in range(2))
    assert first == second != data


def test_values_from_nowhere_and_several_lines_are_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (path,) = (path for path in write_samples(tmp_path) if path.name == "comma.csv")
    original = read_file(path)
    wrong = Column(**{**vars(original.columns[1]), "values": original.columns[1].values * 1.000123})
    spoilt = MeasuredFile(**{**vars(original), "columns": (original.columns[0], wrong, original.columns[2])})
    monkeypatch.setattr("benchmarks.measured_file_mutants.read_file", lambda _: spoilt)
    assert judge(original, path).outcome == "wrong"
    monkeypatch.setattr("benchmarks.measured_file_mutants.read_file", lambda _: 1 / 0)
    assert judge(original, path).outcome == "wrong"
