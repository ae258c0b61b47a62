"""Damaged files of every format: the benchmark sees what it looks for, and a part of it is run here."""

import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks import reader_mutants
from benchmarks.reader_mutants import RESULT, _outcomes, watch
from benchmarks.reader_process import Watched, damaged_bytes, digest, judge
from benchmarks.reader_samples import Sample, samples
from geometry.errors import InputError
from tests.slow import slow


@pytest.mark.parametrize("name", [pytest.param("MAT of matrices", marks=slow), "INP"])
def test_damaged_files_are_right_or_one_sentence(name: str, tmp_path: Path) -> None:
    result = list(watch(name, range(5000, 5030), tmp_path))
    assert [number for number, _, _ in result] == list(range(5000, 5030))
    assert {outcome for _, outcome, _ in result} <= {"right", "sentence"}, result


def test_the_same_number_is_the_same_damage() -> None:
    sound = bytes(range(256))
    assert damaged_bytes(sound, "INP", 7) == damaged_bytes(sound, "INP", 7)
    damages = {damaged_bytes(sound, name, number) for name in ("INP", "BDF") for number in range(20)}
    assert len(damages) > 30
    assert {done for _, done in damages} == {"cut", "damaged"}


def test_every_sample_is_read_and_read_the_same_twice(tmp_path: Path) -> None:
    for name in ("campaign", "OUTPUT4, binary", "VTU", "npz of a reduced model"):
        sample, path = samples()[name], tmp_path / samples()[name].file
        path.parent.mkdir(exist_ok=True)
        sample.write(path)
        assert digest(sample.read(path)) == digest(sample.read(path))


def _sentence(_: Path) -> object:
    raise InputError("the file is damaged: write it again")


def _warn(_: Path) -> object:
    warnings.warn("overflow", RuntimeWarning, stacklevel=1)
    return 1


@pytest.mark.parametrize(
    ("read", "done", "outcome"),
    [
        (lambda _: 1, "damaged", "right"),
        (lambda _: 2, "damaged", "right"),  # another number, as one that was damaged is
        (lambda _: 2, "cut", "wrong"),
        (_sentence, "cut", "sentence"),
        (lambda _: 1 / 0, "damaged", "wrong"),
        (_warn, "damaged", "wrong"),
        (lambda _: sys.exit(1), "damaged", "wrong"),
    ],
)
def test_outcomes_are_told_apart(tmp_path: Path, read: object, done: str, outcome: str) -> None:
    sample = Sample(file="a", write=lambda _: None, read=read, announces=True)  # type: ignore[arg-type]
    assert judge(sample, tmp_path / "a", digest(1), done=done)[0] == outcome


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader_mutants, "LONGEST", 0.3)


def _process(words: str) -> Iterator[object]:
    # Not flushed, so that the next line comes with it: both must be seen.
    code = f'print({RESULT!r} + \'[0, "ready", ""]\')\n{words}'
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as process:
        yield from _outcomes(process)
        process.kill()


@pytest.mark.usefixtures("quick")
def test_a_process_that_stays_busy_hangs_and_one_that_ends_has_crashed() -> None:
    told = f'print({RESULT!r} + \'[3, "right", ""]\', flush=True)\n'
    assert list(_process(told + "while True: pass")) == [(3, "right", ""), "hang"]
    assert list(_process(told + "import os; os.abort()")) == [(3, "right", "")]


def test_files_outside_are_seen(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    watched = Watched(tmp_path / "own")
    (tmp_path / "own" / "a").write_text("x")
    assert not watched.found
    (tmp_path / "b").write_text("x")
    assert "b" in watched.found
    watched.found = ""
    (tmp_path / "b").unlink()
    assert watched.found
    watched._is_own = lambda _: True  # type: ignore[method-assign]  # a hook stays as long as the process
