"""Short stages in a pool: results in order, nothing computed twice, progress of what is computed."""

import importlib
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from geometry.errors import ComputationFailed, InputError
from geometry.registry import loaded_files, module_name
from pipeline.parallel import Task, process_pool
from pipeline.pool import make_map, run_pooled, start_call
from pipeline.progress import Report, SilentProgress
from pipeline.store import Stage, Store

STAGES = """
import os, signal
from pathlib import Path
from geometry.errors import InputError
from pipeline.store import stage

@stage("counted square")
def square(folder: str, number: int) -> int:
    with Path(folder, f"{number}.runs").open("a") as stream:
        stream.write("x")
    if number == 13:
        raise InputError("number = 13 is unlucky: give another")
    if number == 99:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number
"""


class Shown:
    """Progress that keeps what is reported."""

    def __init__(self) -> None:
        self.reports: list[tuple[float, float]] = []

    @contextmanager
    def step(self, name: str, *, expected: float | None = None) -> Iterator[Report]:
        del name, expected
        yield lambda done, total: self.reports.append((done, total))

    def stored(self, name: str) -> None:
        del name


@pytest.fixture
def square(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Stage[..., Any]:
    (tmp_path / "pooled_stages.py").write_text(STAGES)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "pooled_stages", raising=False)
    stage: Stage[..., Any] = importlib.import_module("pooled_stages").square
    return stage


def tasks(square: Stage[..., Any], folder: Path, numbers: list[int]) -> list[Task]:
    return [Task(stage=square, inputs={"folder": str(folder), "number": n}, label=f"{n}") for n in numbers]


@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_order_and_stored_ones_are_neither_computed_nor_shown_as_work(
    square: Stage[..., Any], tmp_path: Path, workers: int
) -> None:
    store, numbers = Store(tmp_path / "cache"), [5, 2, 4, 3, 7, 6]
    assert run_pooled(tasks(square, tmp_path, [2, 7]), 2, store, SilentProgress(), "work", workers) == [4, 49]
    shown = Shown()
    result = run_pooled(tasks(square, tmp_path, numbers), 6, store, shown, "work", workers)
    assert result == [n * n for n in numbers]
    assert {file.name: file.read_text() for file in tmp_path.glob("*.runs")} == {f"{n}.runs": "x" for n in numbers}
    assert shown.reports[-1] == (4, 4)
    shares = [done / total for done, total in shown.reports]
    assert shares == sorted(shares)


def test_an_error_of_a_stage_and_a_killed_process_end_the_work(square: Stage[..., Any], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="13 is unlucky"):
        run_pooled(tasks(square, tmp_path, [2, 13]), 2, Store(None), SilentProgress(), "work", 2)
    with pytest.raises(ComputationFailed, match="killed"):
        run_pooled(tasks(square, tmp_path, [2, 99]), 2, Store(None), SilentProgress(), "work", 2)


def count_plugins(_: int) -> int:
    return len(loaded_files())


def kill_itself(_: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_calls_in_processes_have_the_files_of_this_process_and_explain_a_killed_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "own_law.py"
    file.write_text("")
    # This entry is taken back: a later pool of this process would miss the file.
    monkeypatch.setitem(sys.modules, module_name(file), ModuleType("own_law"))
    with process_pool([], 2) as executor:
        map_over = make_map(executor)
        assert list(map_over(count_plugins, range(3))) == [len(loaded_files())] * 3
        assert start_call(executor, count_plugins, 1)() == len(loaded_files())
        with pytest.raises(ComputationFailed, match="killed"):
            list(map_over(kill_itself, range(2)))
    with process_pool([], 1) as executor:
        wait_for_result = start_call(executor, kill_itself, 1)
        with pytest.raises(ComputationFailed, match="killed"):
            wait_for_result()


def test_a_pool_whose_processes_cannot_begin_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def ended(*_: object) -> None:
        raise EOFError("unexpected EOF")  # of the process that makes processes, where that was killed

    monkeypatch.setattr("pipeline.parallel.ProcessPoolExecutor.submit", ended)
    with pytest.raises(ComputationFailed, match="killed before it started"), process_pool([], 1):
        pass
