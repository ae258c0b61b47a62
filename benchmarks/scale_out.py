"""Test several machines: overhead of dask against local processes, and limits of a rig while workers are killed.

    python -m benchmarks.scale_out [--tasks 40] [--every 20] [--only overhead|killed]

The overhead is measured with tasks that wait for a second and share a model of 1 MB, on two started workers. The rig is
the shipped one with coarse meshes. One of two workers is killed every `--every` seconds and a nanny starts another; the
files must equal those of an undisturbed run on this machine.
"""

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.scale_out_task import Model, wait_a_second
from pipeline.worker_pool import Workers, worker_pool
from study.shipped_cases import RIG

ROOT = Path(__file__).parents[1]
N_WORKER = 2
CHANGES = (
    ("hex20", "hex8"), (r'size = "2.5 mm"', 'size = "8 mm"'), ("modes = 150", "modes = 40"),
    (r"highest = 5\nsamples = 256", "highest = 3\nsamples = 128"), (r"levels = .*", "levels = [3, 10]"),
    (r'step = "0.25 Hz".*', 'step = "1 Hz"'),
)  # fmt: skip
LIMITS = "[limits]\npopulation = 4\nsamples = 6\nblock = 4\n"


def seconds(workers: Workers, n_task: int) -> float:
    """Time of all tasks on started workers [s]."""
    model = Model(np.ones((360, 360)))
    with worker_pool(["benchmarks.scale_out_task"], workers) as pool:
        for future in [pool.submit(wait_a_second, model, number) for number in range(2 * N_WORKER)]:
            future.result()
        begin = time.perf_counter()
        result = [future.result() for future in [pool.submit(wait_a_second, model, n) for n in range(n_task)]]
        assert result == [1.0 + number for number in range(n_task)]
        return time.perf_counter() - begin


@contextmanager
def cluster() -> Iterator[Any]:
    """Start two workers, each with a nanny."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=N_WORKER, threads_per_worker=1, dashboard_address=":0") as made:
        yield made


def overhead(n_task: int) -> None:
    """Print the table of times; both kinds of workers are measured in turn."""
    here, there = [], []
    with cluster() as made:
        for _ in range(3):
            here.append(seconds(N_WORKER, n_task))
            there.append(seconds(made.scheduler_address, n_task))
    ideal = n_task / N_WORKER
    print(f"{n_task} tasks of 1 s on {N_WORKER} workers, {ideal:.0f} s at least; median and range of 3 rounds")
    for name, item in (("this machine", here), ("dask", there)):
        print(f"| {name} | {median(item):.2f} s | {min(item):.2f} to {max(item):.2f} s |")
    print(f"dask against this machine: {100 * (median(there) / median(here) - 1):+.1f} %")


def killed(every: float) -> bool:
    """Compute limits of a rig while workers are killed; returns whether the files equal those of a local run."""
    with tempfile.TemporaryDirectory() as name, cluster() as made:
        folder = Path(name)
        text = RIG.read_text(encoding="utf-8").partition("# Quantity that `stickslip limits`")[0]
        for old, new in CHANGES:
            text = re.sub(old, new, text)
        (folder / "rig.toml").write_text(text + LIMITS, encoding="utf-8")
        command(folder, "solve", "--out", "solved")  # stores the reduced bodies, which both runs reuse
        here = command(folder, "limits", "--out", "here")
        for stored in (folder / "cache" / "objects").rglob("*.npz"):
            if stored.stat().st_mtime > here[0]:
                stored.unlink()
        deaths: list[float] = []
        end = threading.Event()
        killer = threading.Thread(target=kill_workers, args=(made, every, end, deaths))
        killer.start()
        there = command(folder, "limits", "--out", "there", "--scheduler", str(made.scheduler_address))
        end.set()
        killer.join()
        files = [{file.name: file.read_bytes() for file in (folder / out).iterdir()} for out in ("here", "there")]
        same = files[0] == files[1]
        print(f"limits of the rig: {here[1]:.0f} s on this machine, {there[1]:.0f} s on dask with {len(deaths)} of "
              f"its workers killed; {len(files[0])} files, {'the same' if same else 'OTHER'} bytes")  # fmt: skip
    return same


def command(folder: Path, name: str, *words: str) -> tuple[float, float]:
    """Run a command; returns its start time and duration [s]."""
    begin = time.time()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "STICKSLIP_CACHE": str(folder / "cache")}
    line = [sys.executable, "-m", "stickslip", name, "rig.toml", *words, "--quiet"]
    subprocess.run(line, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
    return begin, time.time() - begin


def kill_workers(made: Any, every: float, end: threading.Event, deaths: list[float]) -> None:
    """Kill one of the workers in turn, at equal intervals."""
    while not end.wait(every):
        alive = [worker.pid for worker in made.workers.values() if worker.pid]
        if alive:
            os.kill(alive[len(deaths) % len(alive)], signal.SIGKILL)
            deaths.append(time.time())


def main() -> int:
    """Run both tests; returns 1 if bytes differ."""
    words = argparse.ArgumentParser(prog="python -m benchmarks.scale_out", description=__doc__)
    words.add_argument("--tasks", type=int, default=40)
    words.add_argument("--every", type=float, default=20.0, help="time between two killed workers [s]")
    words.add_argument("--only", choices=("overhead", "killed"))
    given = words.parse_args()
    if given.only != "killed":
        overhead(given.tasks)
    return 0 if given.only == "overhead" or killed(given.every) else 1


if __name__ == "__main__":
    sys.exit(main())
