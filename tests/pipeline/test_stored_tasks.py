"""Results of tasks are found again whole, under their own key alone, and a pool ends with who started it."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hbsolve.limits.task import StageProgress
from pipeline.checkpoint import StoredTasks
from study.limits.curve import END, WORTH_REPORTING, SearchProgress
from tests.slow import slow


def test_a_result_is_found_by_another_process_bit_by_bit(tmp_path: Path) -> None:
    value = {"x": np.array([0.1, -0.0, np.nan]), "y": (np.inf, 1e-300)}
    StoredTasks(tmp_path / "part", "a")["first; level 0"] = value
    kept = StoredTasks(tmp_path / "part", "a")
    assert "first; level 0" in kept
    assert "first; level 1" not in kept
    assert kept["first; level 0"]["x"].tobytes() == value["x"].tobytes()
    assert kept["first; level 0"]["y"] == value["y"]
    del kept["first; level 0"]
    assert "first; level 0" not in StoredTasks(tmp_path / "part", "a")


def test_a_result_of_other_inputs_and_a_damaged_one_are_not_found(tmp_path: Path) -> None:
    kept = StoredTasks(tmp_path / "part", "a")
    kept["task"] = 1.5
    assert "task" not in StoredTasks(tmp_path / "part", "b")
    assert (kept.n_left, StoredTasks(tmp_path / "part", "b").n_left) == (1, 0)
    (file,) = (tmp_path / "part").iterdir()
    file.write_bytes(file.read_bytes()[:-30])
    assert StoredTasks(tmp_path / "part", "a").n_left == 0
    told: list[str] = []
    with pytest.raises(KeyError, match="task"):
        StoredTasks(tmp_path / "part", "a", told.append)["task"]
    assert told == [f"{file} is damaged; its content will be computed again"]
    kept.remove()
    assert not (tmp_path / "part").exists()


def test_progress_only_grows_and_what_was_found_counts_as_no_work() -> None:
    seen: list[float] = []

    def report(done: float, total: float) -> None:
        seen.append(done / total)

    progress = SearchProgress(report)
    # The population was kept, the neighbours are not all.
    progress(StageProgress(stage="population", done=4, total=4))
    progress(StageProgress(stage="neighbours", done=2, total=4))
    before = (END["population"] + END["neighbours"]) / 2
    for stage, done in (("neighbours", 4), ("levels", 1), ("neighbours", 0), ("audit", 2), ("certificates", 4)):
        progress(StageProgress(stage=stage, done=done, total=4))
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1)
    middle = (END["gaps"] + END["audit"]) / 2
    assert seen[-2] == pytest.approx((middle - before) / (1 - before))
    assert min(seen) > WORTH_REPORTING


POOL = """\
import os, sys, time
from collections.abc import Callable
from pathlib import Path
from pipeline.parallel import process_pool

if __name__ == "__main__":
    with process_pool(["time"], 2) as pool:
        pids = {pool.submit(os.getpid).result()}
        waiting = pool.submit(time.sleep, 600)
        Path("pids.txt").write_text(" ".join(map(str, pids)))
        if sys.argv[1] == "wait":
            waiting.result()
"""


@pytest.mark.parametrize("end", ["wait", "leave"])
def test_processes_end_with_the_one_that_was_killed_or_left_early(tmp_path: Path, end: str) -> None:
    (tmp_path / "pool.py").write_text(POOL)
    with subprocess.Popen([sys.executable, "pool.py", end], cwd=tmp_path) as process:
        _until((tmp_path / "pids.txt").exists)
        _until(lambda: bool((tmp_path / "pids.txt").read_text()))
        if end == "wait":
            process.send_signal(signal.SIGKILL)
        process.wait()
    assert process.returncode == (-signal.SIGKILL if end == "wait" else 0)
    for pid in (tmp_path / "pids.txt").read_text().split():
        _until(lambda pid=pid: not _runs(int(pid)))


INTERRUPTED = """\
from time import sleep
from pipeline.parallel import process_pool

if __name__ == "__main__":
    try:
        with process_pool(["slow_import"], 2) as pool:
            pool.submit(sleep, 600).result()
    except KeyboardInterrupt:
        print("interrupted")
"""
SLOW_IMPORT = """\
from pathlib import Path
from time import sleep
Path("importing").touch()
sleep(3)
Path("imported").touch()
"""


@pytest.mark.parametrize("moment", ["importing", pytest.param("imported", marks=slow)])
def test_a_terminals_interruption_of_a_pool_is_silent_even_while_it_imports(tmp_path: Path, moment: str) -> None:
    (tmp_path / "pool.py").write_text(INTERRUPTED)
    (tmp_path / "slow_import.py").write_text(SLOW_IMPORT)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    with subprocess.Popen(
        [sys.executable, "pool.py"], cwd=tmp_path, env=environment, start_new_session=True, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        _until((tmp_path / moment).exists)
        os.killpg(process.pid, signal.SIGINT)  # a terminal sends it to all processes
        out, errors = process.communicate(timeout=60)
    assert (out, errors) == ("interrupted\n", "")


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
        # A process that has ended, but whose parent has not asked how, is still listed.
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False


def _until(true: Callable[[], bool]) -> None:
    for _ in range(600):
        if true():
            return
        time.sleep(0.1)
    pytest.fail("it did not happen within a minute")


def test_a_result_stays_known_when_another_process_removes_the_folder(tmp_path: Path) -> None:
    tasks = StoredTasks(tmp_path / "part", "a")
    tasks["first"] = np.arange(3.0)
    shutil.rmtree(tmp_path / "part")
    np.testing.assert_array_equal(tasks["first"], np.arange(3.0))
    tasks["second"] = 2.0
    assert tasks["second"] == 2.0
    shutil.rmtree(tmp_path)
    tasks["third"] = 3.0
    assert tasks["third"] == 3.0
