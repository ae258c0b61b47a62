"""Read damaged files of every format of the program: each must give correct data or an error message.

A separate process reads the files of a format one after the other; a parent watches it. The outcome of a file is

right     data that are correct, or differ where a value was damaged; a cut file of a format that states its size, and a
          file with a checksum, must be refused or give all written data
sentence  an `InputError` of printable text
wrong     another exception, a value that was not written, or a warning of Python
crash     the process ended
hang      more than 5 s of processor time
memory    more than 1 GiB and twenty times the size of the file beyond the memory for the undamaged file
outside   another file was written, moved or removed, or a program was started

    python -m benchmarks.reader_mutants [--count N] [--first NUMBER] [--only WORD ...] [--keep FOLDER]
"""

import argparse
import contextlib
import json
import os
import re
import selectors
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

OUTCOMES = ("right", "sentence", "wrong", "crash", "hang", "memory", "outside")
#: Largest processor time of one file [s], and interval at which it is checked [s].
LONGEST, LOOK = 5.0, 0.2
RESULT = "#result "
#: Prefix of the name of a saved damaged file, before its number.
ASIDE = ".wrong_"


def watch(name: str, numbers: range, folder: Path) -> Iterator[tuple[int, str, str]]:
    """Run and watch the reading process; yields number, outcome and reason of each damaged file of a format.

    Parameters
    ----------
    name
        Name of the format in `benchmarks.reader_samples`.
    numbers
        Numbers of the files, which are the seeds of their damage.
    folder
        Scratch folder.
    """
    waiting = list(numbers)
    while waiting:
        where = folder / "work"
        shutil.rmtree(where, ignore_errors=True)
        where.mkdir()
        command = [
            sys.executable,
            "-m",
            "benchmarks.reader_process",
            name,
            str(where),
            str(waiting[0]),
            str(numbers.stop),
        ]
        # Errors go to a file, because a full pipe would block the process.
        with (
            (folder / "errors").open("w") as errors,
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors) as process,
        ):
            ended = ""
            for outcome in _outcomes(process):
                if isinstance(outcome, str):
                    ended = outcome
                    break
                yield outcome
                waiting = [number for number in waiting if number > outcome[0]]
            process.kill()
        if waiting and ended != "again":
            words = (folder / "errors").read_text(errors="replace").strip()[-300:]
            yield waiting.pop(0), ended or "crash", " ".join(words.split())


def _outcomes(process: "subprocess.Popen[bytes]") -> Iterator[tuple[int, str, str] | str]:
    """Outcomes that a process prints; the last may be "hang", or "again" if it requests a new process."""
    assert process.stdout is not None
    spent = _processor_time(process.pid)
    started, begun = False, b""
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        while True:
            if selector.select(LOOK):
                # Unbuffered: `select` does not see a line in a Python buffer.
                if not (output := os.read(process.stdout.fileno(), 65536)):
                    return
                *lines, begun = (begun + output).split(b"\n")
                for line in lines:
                    if not line.startswith(RESULT.encode()):
                        continue
                    number, outcome, reason = json.loads(line.removeprefix(RESULT.encode()))
                    if outcome == "again":
                        yield "again"
                        return
                    started, spent = True, _processor_time(process.pid)
                    if outcome != "ready":
                        yield number, outcome, reason
            elif started and _processor_time(process.pid) - spent > LONGEST:
                yield "hang"
                return


def _processor_time(process: int) -> float:
    with contextlib.suppress(OSError):
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def run(names: list[str], numbers: range, keep: Path | None) -> dict[str, Counter[str]]:
    """Outcomes by format; prints those that are neither right nor a sentence."""
    table: dict[str, Counter[str]] = {}
    for name in names:
        table[name] = Counter()
        begin = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            for number, outcome, reason in watch(name, numbers, Path(folder)):
                table[name][outcome] += 1
                if outcome not in {"right", "sentence"}:
                    print(f"{name} {number}: {outcome}: {reason[:300]}", flush=True)
                    if keep is not None:
                        _keep(keep, name, number, Path(folder))
        print(f"# {name}: {dict(table[name])} {time.perf_counter() - begin:.0f} s", flush=True)
    return table


def _keep(folder: Path, name: str, number: int, scratch: Path) -> None:
    """Copy a damaged file: the one that its process saved, or the one that was being read when the process ended."""
    from benchmarks.reader_samples import samples

    left = scratch / "work" / samples()[name].file
    aside = left.with_name(f"{ASIDE}{number}")
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(OSError):
        shutil.copy(aside if aside.exists() else left, folder / f"{re.sub('[ ,.]+', '_', name)}_{number}_{left.name}")


def format_table(table: dict[str, Counter[str]]) -> str:
    """Table of the outcomes in Markdown."""
    lines = ["| format | " + " | ".join(OUTCOMES) + " |", "|---" * (len(OUTCOMES) + 1) + "|"]
    for name, counts in table.items():
        lines.append(f"| {name} | " + " | ".join(str(counts[outcome]) for outcome in OUTCOMES) + " |")
    return "\n".join(lines)


def main(arguments: Any = None) -> int:
    """Print the table; returns 1 if any outcome is neither right nor a sentence."""
    from benchmarks.reader_samples import samples

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args(arguments)
    names = [name for name in samples() if not given.only or any(word in name for word in given.only)]
    table = run(names, range(given.first, given.first + given.count), given.keep)
    print(format_table(table))
    return int(any(counts[outcome] for counts in table.values() for outcome in OUTCOMES[2:]))


if __name__ == "__main__":
    sys.exit(main())
