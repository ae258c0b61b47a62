"""Tasks on a dask scheduler: results of this machine, one sentence for what does not fit, nothing left running."""

import importlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from geometry.errors import ComputationFailed, InputError, MissingSoftware
from pipeline.parallel import Task
from pipeline.pool import run_pooled
from pipeline.progress import SilentProgress
from pipeline.store import Store
from pipeline.worker_pool import count_workers, worker_pool

distributed = pytest.importorskip("distributed")

TIMEOUT = 60  # s; a hang is an error, a slow machine is none

STAGES = """
import os, signal, time
from dataclasses import dataclass
from pathlib import Path
from geometry.errors import InputError
from pipeline.store import stage

@dataclass(frozen=True, eq=False)
class Large:
    numbers: object

    def __reduce__(self):
        with open(os.environ["PICKLED"], "a") as stream:
            stream.write("x")
        return Large, (self.numbers,)

@stage("counted square of a worker")
def square(folder: str, number: int) -> int:
    with Path(folder, f"{number}.runs").open("a") as stream:
        stream.write(f"{os.getpid()} {os.getppid()}\\n")
    if number == 13:
        raise InputError("number = 13 is unlucky: give another")
    if number > 50:
        time.sleep(1)
    return number * number

def total(large, factor):
    return factor * large.numbers.sum()

def environment():
    return os.environ["OPENBLAS_NUM_THREADS"], signal.getsignal(signal.SIGINT) is signal.SIG_IGN, os.getcwd()

def ends_itself():
    os.kill(os.getpid(), signal.SIGKILL)

def sleeps(folder):
    Path(folder, "pid").write_text(str(os.getpid()))
    time.sleep(150)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("scheduled")
    (folder / "scheduled_stages.py").write_text(STAGES)
    return folder


@pytest.fixture(scope="module")
def stages(folder: Path) -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        patch.setenv("PICKLED", str(folder / "pickled"))
        yield importlib.import_module("scheduled_stages")


@pytest.fixture(scope="module")
def cluster(stages: ModuleType) -> Iterator[Any]:
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as made:
        yield made


@pytest.fixture
def address(cluster: Any) -> str:
    return str(cluster.scheduler_address)


def squares(stages: ModuleType, folder: Path, numbers: list[int]) -> list[Task]:
    return [Task(stage=stages.square, inputs={"folder": str(folder), "number": n}, label=f"{n}") for n in numbers]


def wait_until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + TIMEOUT
    while not done():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.05)


def test_results_come_in_order_from_processes_beside_the_workers_and_are_stored_here(
    stages: ModuleType, address: str, tmp_path: Path
) -> None:
    store = Store(tmp_path / "cache")
    for _ in range(2):
        result = run_pooled(squares(stages, tmp_path, [5, 2, 4]), 3, store, SilentProgress(), "work", address)
        assert result == [25, 4, 16]
    lines = [(tmp_path / f"{n}.runs").read_text().split() for n in (5, 2, 4)]
    assert all(len(line) == 2 for line in lines)  # each was computed once
    assert not {os.getpid(), *(int(pid) for pid, _ in lines)} & {int(parent) for _, parent in lines}


def test_a_task_has_one_thread_and_does_not_hear_ctrl_c(stages: ModuleType, address: str) -> None:
    with worker_pool(["scheduled_stages"], address) as pool:
        assert count_workers(pool, address) == 2
        threads, deaf, _ = pool.submit(stages.environment).result(TIMEOUT)
    assert (threads, deaf) == ("1", True)


def test_a_value_of_many_tasks_is_pickled_once(stages: ModuleType, address: str, folder: Path) -> None:
    large = stages.Large(np.ones(10_000))
    with worker_pool(["scheduled_stages"], address) as pool:
        result = [pool.submit(stages.total, large, factor) for factor in range(6)]
        assert [future.result(TIMEOUT) for future in result] == [10_000 * factor for factor in range(6)]
    assert (folder / "pickled").read_text() == "x"


def test_an_error_of_a_stage_comes_back_and_what_ended_beside_it_is_stored(
    stages: ModuleType, address: str, tmp_path: Path
) -> None:
    store = Store(tmp_path / "cache")
    with pytest.raises(InputError, match="13 is unlucky"):
        run_pooled(squares(stages, tmp_path, [2, 13]), 2, store, SilentProgress(), "work", address)
    assert not store.has(stages.square, folder=str(tmp_path), number=13)


def test_a_task_that_kills_its_process_again_and_again_is_given_up(stages: ModuleType, address: str) -> None:
    with worker_pool(["scheduled_stages"], address) as pool, pytest.raises(ComputationFailed, match="memory"):
        pool.submit(stages.ends_itself).result(TIMEOUT)


def test_at_an_early_end_what_runs_is_killed(stages: ModuleType, address: str, tmp_path: Path) -> None:
    class Enough(Exception):
        pass

    def run_until(end: Exception) -> None:
        with worker_pool(["scheduled_stages"], address) as pool:
            pool.submit(stages.sleeps, str(tmp_path))
            wait_until(lambda: (tmp_path / "pid").exists() and bool((tmp_path / "pid").read_text()))
            raise end

    with pytest.raises(Enough):
        run_until(Enough())
    pid = int((tmp_path / "pid").read_text())
    wait_until(lambda: not Path(f"/proc/{pid}").exists())


def test_a_killed_worker_costs_only_what_it_had_in_hand(
    stages: ModuleType, cluster: Any, address: str, tmp_path: Path
) -> None:
    numbers = [*range(51, 57)]
    finished: list[float] = []

    class Killing(SilentProgress):
        """Kills a worker once, when two tasks are done."""

        def step(self, name: str, *, expected: float | None = None) -> Any:
            del name, expected

            def report(done: float, total: float) -> None:
                finished.append(done)
                if done >= 2 and not (tmp_path / "victim").exists():
                    victim = next(iter(cluster.workers.values())).pid
                    (tmp_path / "victim").write_text(str(victim))
                    os.kill(victim, signal.SIGKILL)

            return nullcontext(report)

    result = run_pooled(squares(stages, tmp_path, numbers), 6, Store(None), Killing(), "work", address)
    assert result == [n * n for n in numbers]
    runs = [(tmp_path / f"{n}.runs").read_text().splitlines() for n in numbers]
    # The worker had one task in hand, or was between two.
    assert sum(map(len, runs)) <= len(numbers) + 1
    assert finished == sorted(finished)


def test_other_code_on_a_worker_is_refused(stages: ModuleType, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.scheduler.hash_code", lambda _: "another")
    with worker_pool(["scheduled_stages"], address) as pool, pytest.raises(InputError, match="version of stickslip"):
        pool.submit(stages.environment).result(TIMEOUT)


def test_another_version_of_dask_is_refused(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(distributed, "__version__", "1.0.0")
    with pytest.raises(InputError, match=r"1\.0\.0"), worker_pool(["scheduled_stages"], address):
        pass


@pytest.mark.parametrize("wrong", ["tcp://127.0.0.1:9", "nonsense://x:1", "127.0.0.1", ""])
def test_an_address_where_no_scheduler_answers_is_one_sentence(wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.scheduler.PATIENCE", 0.5)
    with pytest.raises(InputError, match="--scheduler") as caught, worker_pool(["scheduled_stages"], wrong):
        pass
    assert "\n" not in str(caught.value)


def test_a_missing_package_is_named_with_what_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingSoftware, match=r'install -e "\.\[dask\]"'), worker_pool([], "tcp://127.0.0.1:9"):
        pass


def test_the_process_beside_a_worker_ends_with_it(stages: ModuleType, folder: Path, tmp_path: Path) -> None:
    script = (
        "import sys, pickle; from pipeline.task_process import TaskProcess, RemoteCall; import scheduled_stages as s\n"
        "call = RemoteCall(pickled=pickle.dumps((s.sleeps, (sys.argv[1],), {})), versions={}, plugins={})\n"
        "TaskProcess().run(call, [], lambda: True)\n"
    )
    worker = subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], cwd=folder)
    wait_until(lambda: (tmp_path / "pid").exists() and bool((tmp_path / "pid").read_text()))
    worker.kill()
    worker.wait()
    pid = int((tmp_path / "pid").read_text())
    wait_until(lambda: not Path(f"/proc/{pid}").exists())
