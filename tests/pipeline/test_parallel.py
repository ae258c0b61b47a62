"""Stages side by side: results in order, nothing computed twice, and every early end without a trace or an orphan."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from geometry.errors import ComputationFailed, InputError
from pipeline.parallel import ONE_THREAD, Task, count_default_workers, run_parallel
from pipeline.progress import SilentProgress
from pipeline.store import Stage, Store

TIMEOUT = 60  # s; a hang is an error, a slow machine is none

STAGES = """
import os, signal, subprocess, time
from pathlib import Path
from geometry.errors import InputError
from pipeline.store import stage

@stage("square")
def square(number: int) -> int:
    return number * number

@stage("threads")
def threads(names: tuple) -> tuple:
    return tuple(os.environ.get(name, "") for name in names)

@stage("deaf")
def deaf() -> bool:
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())

@stage("refusal")
def refusal(number: int) -> int:
    raise InputError(f"number = {number} is odd: give an even one")

class Peculiar(Exception):
    def __init__(self, first, second):
        super().__init__(f"{first} and {second}")
        self.handle = open(__file__)

@stage("mistake")
def mistake(number: int) -> float:
    if number == 7:
        raise Peculiar("first", "second")
    return 1 / number

@stage("killed")
def killed(number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)

@stage("slow")
def slow(folder: str, number: int) -> int:
    Path(folder, f"started{number}").write_text(str(os.getpid()))
    time.sleep(150)
    return number

@stage("program")
def program(folder: str) -> int:
    child = subprocess.Popen(["sleep", "150"])
    Path(folder, "started0").write_text(str(child.pid))
    return child.wait()
"""
# What `study.cli` does around a command, with one command that computes for a minute.
RUNNER = """
import sys
from pathlib import Path
import parallel_stages as stages
from study import cli, console
from pipeline.parallel import Task, run_parallel
from pipeline.progress import SilentProgress
from pipeline.store import Store

def work():
    tasks = [Task(stage=stages.square, inputs={"number": 3}, label="square", weight=9.0)]
    if sys.argv[2] == "program":
        tasks.append(Task(stage=stages.program, inputs={"folder": sys.argv[1]}, label="program"))
    else:
        tasks += [Task(stage=stages.slow, inputs={"folder": sys.argv[1], "number": n}, label="slow") for n in range(4)]
    run_parallel(tasks, Store(Path(sys.argv[1], "cache")), SilentProgress(), "work", workers=2)

if __name__ == "__main__":
    with console.standard_output(as_json=False) as output:
        sys.exit(int(cli._run_guarded(work, [], output)))
"""


class Stages:
    """The stages of the module that worker processes can import."""

    def __getattr__(self, name: str) -> Stage[..., object]:
        import importlib

        result: Stage[..., object] = getattr(importlib.import_module("parallel_stages"), name)
        return result


@pytest.fixture
def stages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Stages:
    (tmp_path / "parallel_stages.py").write_text(STAGES)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "parallel_stages", raising=False)
    return Stages()


def run(tasks: list[Task], store: Store) -> list[object]:
    return [outcome.value for outcome in run_parallel(tasks, store, SilentProgress(), "work", workers=2)]


def test_results_come_in_the_order_of_the_tasks_and_the_second_time_from_the_store(
    stages: Stages, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tasks = [
        Task(stage=stages.square, inputs={"number": n}, label=f"{n}", weight=weight)
        for n, weight in ((5, 1.0), (2, 7.0), (4, 3.0))
    ]
    assert run(tasks, Store(tmp_path / "cache")) == [25, 4, 16]
    monkeypatch.setattr("pipeline.parallel._start", lambda *_: pytest.fail("a process was started"))
    outcomes = run_parallel(tasks, Store(tmp_path / "cache"), SilentProgress(), "work")
    assert [(outcome.value, outcome.cached) for outcome in outcomes] == [(25, True), (4, True), (16, True)]


def test_there_are_as_many_processes_as_cores_that_are_allotted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A batch system gives a job four cores of a hundred."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3, 5, 90})
    assert count_default_workers() == 3


def test_without_a_store_results_come_back_all_the_same(stages: Stages) -> None:
    assert run([Task(stage=stages.square, inputs={"number": 3}, label="3")], Store(None)) == [9]


def test_each_process_has_one_thread_and_the_environment_is_as_before(
    stages: Stages, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    (result,) = run([Task(stage=stages.threads, inputs={"names": tuple(ONE_THREAD)}, label="threads")], Store(None))
    assert set(result) == {"1"}  # type: ignore[call-overload]
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def test_a_process_never_sees_ctrl_c_which_would_only_make_it_print_where_it_was(stages: Stages) -> None:
    assert run([Task(stage=stages.deaf, inputs={}, label="deaf")], Store(None)) == [True]


def test_what_a_stage_refuses_is_refused_with_its_sentence(stages: Stages, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^number = 3 is odd: give an even one$"):
        run([Task(stage=stages.refusal, inputs={"number": 3}, label="refusal")], Store(tmp_path))


def test_a_mistake_of_ours_tells_where_it_was(stages: Stages, tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError) as caught:
        run([Task(stage=stages.mistake, inputs={"number": 0}, label="mistake")], Store(tmp_path))
    assert "parallel_stages.py" in caught.value.__notes__[0]
    with pytest.raises(RuntimeError, match=r"^Peculiar: first and second$"):
        run([Task(stage=stages.mistake, inputs={"number": 7}, label="mistake")], Store(tmp_path))


def test_a_failure_ends_what_runs_beside_it(stages: Stages, tmp_path: Path) -> None:
    slow = Task(stage=stages.slow, inputs={"folder": str(tmp_path), "number": 0}, label="slow", weight=9.0)
    with pytest.raises(InputError, match="number = 3 is odd"):
        run([slow, Task(stage=stages.refusal, inputs={"number": 3}, label="refusal")], Store(tmp_path / "cache"))
    started = tmp_path / "started0"
    assert not started.exists() or not alive(int(started.read_text()))


def test_tasks_wait_until_their_memory_is_free_and_a_large_one_runs_alone(stages: Stages) -> None:
    from pipeline.parallel import _admit_tasks

    tasks = [Task(stage=stages.square, inputs={}, label="", memory=memory) for memory in (5.0, 4.0, 3.0, 20.0)]
    assert _admit_tasks(tasks, [0, 1, 2, 3], [], 4, 8.0) == [0, 2]
    assert _admit_tasks(tasks, [1, 2, 3], [0], 4, 9.0) == [1]
    assert _admit_tasks(tasks, [3], [], 4, 8.0) == [3]
    assert _admit_tasks(tasks, [3], [0], 4, 8.0) == []
    assert _admit_tasks(tasks, [0, 1, 2], [], 2, 1e9) == [0, 1]


def test_a_killed_process_is_a_failed_computation_with_a_remedy_and_keeps_what_was_finished(
    stages: Stages, tmp_path: Path
) -> None:
    good = Task(stage=stages.square, inputs={"number": 3}, label="square")
    run([good], Store(tmp_path))
    bad = Task(stage=stages.killed, inputs={"number": 1}, label="model 7")
    with pytest.raises(ComputationFailed, match=r"^model 7 was killed, most often for lack of memory: close other pro"):
        run([good, bad], Store(tmp_path))
    assert Store(tmp_path).has(stages.square, number=3)


def test_a_script_without_a_guard_names_it(tmp_path: Path) -> None:
    (tmp_path / "parallel_stages.py").write_text(STAGES)
    (tmp_path / "script.py").write_text(
        "import parallel_stages as stages\n"
        "from pipeline.parallel import Task, run_parallel\n"
        "from pipeline.progress import SilentProgress\n"
        "from pipeline.store import Store\n"
        'task = Task(stage=stages.square, inputs={"number": 3}, label="square")\n'
        'run_parallel([task], Store(None), SilentProgress(), "squares")\n'
    )
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert 'if __name__ == "__main__":' in done.stderr.splitlines()[-1]


def start(tmp_path: Path, kind: str) -> "subprocess.Popen[str]":
    (tmp_path / "run.py").write_text(RUNNER)
    return subprocess.Popen(
        [sys.executable, str(tmp_path / "run.py"), str(tmp_path), kind],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_until(done: object, *, timeout: float = TIMEOUT) -> None:
    end = time.monotonic() + timeout
    while not done():  # type: ignore[operator]
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.05)


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and waits for a parent does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def group(leader: int) -> list[int]:
    """Running processes of a session."""
    result = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, session = file.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(session) == leader and state != "Z":
            result.append(int(file.parent.name))
    return result


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
@pytest.mark.parametrize("whole_group", [True, False], ids=["terminal", "kill"])
@pytest.mark.parametrize("kind", ["slow", "program"])
def test_interrupted_it_says_one_sentence_keeps_what_is_done_and_leaves_no_process(
    stages: Stages, tmp_path: Path, kind: str, whole_group: bool
) -> None:
    process = start(tmp_path, kind)
    store = Store(tmp_path / "cache")
    wait_until(lambda: (tmp_path / "started0").exists() and store.has(stages.square, number=3))
    # A terminal sends Ctrl-C to the workers too.
    (os.killpg if whole_group else os.kill)(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 3
    assert errors == "stickslip: interrupted; finished work is stored: the same command continues from there\n"
    assert store.has(stages.square, number=3)
    wait_until(lambda: not group(process.pid), timeout=10)
