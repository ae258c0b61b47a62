"""`python -m benchmarks.strangers --seeds 0:20`: make strangers, diagnose them, and print the score."""

import argparse
import json
import multiprocessing
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.strangers.score import summary, table

#: Seeds of development are below the first number; sealed seeds, for a final score only, are from the second on.
DEVELOPMENT, SEALED = 1000, 10000


def main() -> None:
    """Run the seeds and print the score."""
    words = argparse.ArgumentParser(prog="python -m benchmarks.strangers", description=__doc__)
    words.add_argument("--seeds", default="0:20", help="first:last+1; below 1000 for development")
    words.add_argument("--sealed", action="store_true", help="allows seeds from 10000 on, for a final score")
    words.add_argument("--keep", type=Path, help="folder for cases and campaigns")
    words.add_argument("--processes", type=int, default=1)
    words.add_argument("--scheduler", help="address of a dask scheduler whose workers do them (docs/scale_out.md)")
    words.add_argument("--trials", type=int, default=0, help="as of stickslip diagnose")
    words.add_argument(
        "--output", type=Path, help="file of records, one JSON object a line; those in it are not redone"
    )
    words.add_argument("--pictures", type=Path, help="folder for confusion matrix and reliability diagram")
    given = words.parse_args()
    first, last = map(int, given.seeds.split(":"))
    if last > DEVELOPMENT and not (given.sealed and first >= SEALED):
        words.error(f"seeds {given.seeds}: take those below {DEVELOPMENT}, or with --sealed those from {SEALED} on")
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[threads] = "1"  # the processes below read them when they import numpy
    from benchmarks.strangers.trial import run

    lines = given.output.read_text(encoding="utf-8").splitlines() if given.output and given.output.exists() else []
    records = [record for record in map(json.loads, lines) if first <= record["seed"] < last]
    left = sorted({*range(first, last)} - {record["seed"] for record in records})
    for record in _made(partial(run, keep=given.keep, trials=given.trials), left, given.processes, given.scheduler):
        records.append(record)
        print(summary(record), flush=True)
        if given.output:
            with given.output.open("a", encoding="utf-8") as file:
                file.write(json.dumps(record) + "\n")
    print(table(records))
    if given.pictures:
        from benchmarks.strangers.diagram import draw_confusion, draw_reliability

        given.pictures.mkdir(parents=True, exist_ok=True)
        made = [record for record in records if record["made"]]
        draw_confusion(made, given.pictures / "confusion.png")
        draw_reliability(made, given.pictures / "reliability.png")


def _made(
    work: Callable[[int], Mapping[str, Any]], seeds: Sequence[int], processes: int, scheduler: str | None
) -> Iterator[Mapping[str, Any]]:
    """Records in the order of completion."""
    if scheduler is None:
        with multiprocessing.get_context("spawn").Pool(processes, maxtasksperchild=20) as pool:
            yield from pool.imap_unordered(work, seeds)
    else:
        from pipeline.worker_pool import worker_pool

        with worker_pool(["benchmarks.strangers.trial"], scheduler) as workers:
            for future in as_completed([workers.submit(work, seed) for seed in seeds]):
                yield future.result()


if __name__ == "__main__":
    main()
