"""Commands on small matrices take one thread, and the user's word for more."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.blas_threads import ONE_THREAD, set_one_thread_by_default
from study.cli import main


def test_one_thread_unless_the_user_says_more(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ONE_THREAD:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MKL_NUM_THREADS", "2")
    set_one_thread_by_default()
    assert [os.environ[name] for name in ONE_THREAD] == ["1", "2", "1"]


@pytest.mark.parametrize("command", ["solve", "limits", "compare", "diagnose", "reduce", "modes", "table1"])
def test_it_is_said_before_numpy_is_loaded(command: str) -> None:
    script = f"import sys, os, study.cli\nfrom study.command import {command}\nprint('numpy' in sys.modules)\n"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.split() == ["False"]


@pytest.mark.parametrize("words", [["solve", "no.toml"], ["limits", "no.toml"], ["compare", "no.toml", "no"],
                                   ["diagnose", "no.toml", "no"]])  # fmt: skip
def test_the_commands_say_it(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ONE_THREAD:
        monkeypatch.setenv(name, "7")  # put back afterwards
        monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)
    assert main([*words, "--quiet"]) == 2
    assert {os.environ.get(name) for name in ONE_THREAD} == {"1"}


@pytest.mark.parametrize("words", [["reduce", "no.toml"], ["modes", "no.toml"], ["table1", "no.toml"]])
def test_commands_on_large_matrices_leave_the_threads_of_mkl(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ONE_THREAD:
        monkeypatch.setenv(name, "7")  # put back afterwards
        monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)
    assert main([*words, "--quiet"]) == 2
    assert {name for name in ONE_THREAD if name in os.environ} == {"OPENBLAS_NUM_THREADS"}
