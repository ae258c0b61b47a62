"""Rehearsals: what ends, stops or overfills the process that reads a file leaves this one alone."""

import ctypes
import itertools
import os
import time
from pathlib import Path

import numpy as np
import pytest

from geometry.trial_process import LEAST_SECONDS, read_in_trial_process


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "file"
    path.write_bytes(bytes(1000))
    return path


def _crash() -> None:
    ctypes.string_at(0)


def _abort() -> None:
    os.abort()


def _loop() -> None:
    for _ in itertools.count():
        pass


def _fill() -> None:
    np.ones(3 << 30, dtype=np.uint8)


@pytest.mark.parametrize(
    ("read", "reason"),
    [(_crash, "ends its reader"), (_abort, "ends its reader"), (_loop, f"more than {LEAST_SECONDS} s"), (_fill, "GB")],
)
def test_a_trap_is_told_from_a_file(file: Path, read: object, reason: str) -> None:
    told = read_in_trial_process(read, file, speed=1e6, memory=10)  # type: ignore[arg-type]
    assert told is not None
    assert reason in told


def test_a_file_that_is_read_or_refused_is_no_trap(file: Path) -> None:
    assert read_in_trial_process(file.read_bytes, file, speed=1e6, memory=10) is None
    assert read_in_trial_process(lambda: 1 / 0, file, speed=1e6, memory=10) is None


def test_what_a_trial_process_reads_changes_nothing_here(file: Path) -> None:
    seen: list[bytes] = []
    assert read_in_trial_process(lambda: seen.append(file.read_bytes()), file, speed=1e6, memory=10) is None
    assert not seen


def test_a_copy_that_only_waits_says_nothing_of_the_file(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copies, fork = [], os.fork
    monkeypatch.setattr("geometry.trial_process.PATIENCE", 0.1)
    monkeypatch.setattr("geometry.trial_process.os.fork", lambda: copies.append(fork()) or copies[-1])
    assert read_in_trial_process(lambda: time.sleep(60), file, speed=1e6, memory=10) is None
    with pytest.raises(ProcessLookupError):  # nobody is left behind
        os.kill(copies[0], 0)


def test_a_copy_that_works_for_longer_than_one_waits_is_waited_for(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("geometry.trial_process.PATIENCE", 0.1)

    def work_and_crash() -> None:
        begin = time.process_time()
        while time.process_time() < begin + 0.5:
            pass
        _crash()

    assert read_in_trial_process(work_and_crash, file, speed=1e6, memory=10) is not None
