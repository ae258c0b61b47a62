"""Inject faults of machine and user into every long command: finished work must not be lost or computed again.

After each fault the same command runs again without it. Its files must equal those of an undisturbed run, and it must
not compute stored results again. Faults are

- SIGINT, SIGTERM and SIGKILL at random moments;
- a full disk (a small tmpfs) for results and for the cache, a read-only disk for results, a folder of results that is
  deleted while the command runs;
- two processes at the same time with one folder of results and one cache;
- a changed byte in every stored file; results of another version with a valid checksum;
- few file handles; a killed worker process;
- a system clock that is set back by a year.

    python -m benchmarks.faults [--count MOMENTS] [--only WORD ...]        (as root, for the disks)
"""

import argparse
import csv
import hashlib
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.two_masses import write_two_masses

ROOT = Path(__file__).parents[1]
SEED = 33
#: Time limit of each command [s].
LONGEST = 900
YEAR = 365 * 24 * 3600.0
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
#: Exit codes of an interrupted run: signal handled by Python; finished before the signal; ended by the signal itself.
INTERRUPTED = {3, 0, -signal.SIGKILL, -signal.SIGTERM, -signal.SIGINT}
#: Times of writing in the files of the CAD kernel, reduced models and diagnosis histories.
TIMES = re.compile(rb"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\+00:00)?)?")

#: Time and memory of the rows of `table1`, in its page and its table.
COST = re.compile(rb'<td class="cost">[^<]*</td>')
COSTS = {"seconds", "memory_bytes"}


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command on a small case.

    Parameters
    ----------
    words
        Words after `stickslip`.
    changes
        Replacements of lines, by shipped file.
    files
        Shipped files that the case needs.
    prepare
        Writes further files into a folder.
    """

    words: tuple[str, ...]
    files: tuple[str, ...]
    changes: Mapping[str, Sequence[tuple[str, str]]] = field(default_factory=dict)
    prepare: Callable[[Path], object] = lambda _: None


CHAIN = ("solve_chain.toml", "solve_chain.npz")
COMMANDS = {
    "solve": Command(
        words=("solve", "solve_chain.toml"), files=CHAIN,
        changes={"solve_chain.toml": [(r"levels = .*", "levels = [1, 4]")]},
    ),
    "sweep": Command(
        words=("sweep", "solve_chain.toml", "zeta=0.9,1.1,1.3"), files=CHAIN,
        changes={"solve_chain.toml": [(r"levels = .*", "levels = [2]"), (r'step = .*', 'step = "2 Hz"')]},
    ),
    "limits": Command(
        words=("limits", "wedge_damper.toml"), files=("wedge_damper.toml", "wedge_damper.npz"),
        changes={"wedge_damper.toml": [
            (r"levels = .*", "levels = [0.4]"), (r"step = .*", 'step = "18 Hz"'), (r"samples = 100.*", "samples = 4"),
            (r"block = 7.*", "block = 1\npopulation = 4"),
        ]},
    ),
    "reduce": Command(
        words=("reduce", "blade.toml"), files=("blade.toml",),
        changes={"blade.toml": [
            ("hex20", "hex8"), ("elements_through_thickness = 2", "elements_through_thickness = 1"),
            ("modes = 150", "modes = 20"),
        ]},
    ),
    "diagnose": Command(
        words=("diagnose", "chain.toml", "campaign", "--without", "spring", "dashpot", "cubic"), files=(),
        prepare=lambda folder: write_two_masses(folder, {"mass at tip": 0.006}),
    ),
    "table1": Command(
        words=("table1", "table1_plain.toml"), files=("table1_plain.toml",),
        changes={"table1_plain.toml": [
            # A stubby bar: the first two of ten models, one prediction, and all meshes coarse.
            (r"(?s)(\n\[\[model\]\]\nmodel = 3\b.*?)(?=\n\[\[prediction\]\])", ""),
            (r"(?s)(\n\[\[prediction\]\].*?)(\n\[\[prediction\]\].*?)(?=\n# Nested)", r"\1"),
            ("elements_through_thickness = [34]", "elements_through_thickness = 2"), ("modes = 150", "modes = 20"),
            ('"201.6 mm"', '"100 mm"'), ('"24 mm"', '"12 mm"'), ('root_height = "20 mm"', 'root_height = "10 mm"'),
            ('length_cap = "5 mm"', 'length_cap = "10 mm"'), ('length_cap = "12 mm"', 'length_cap = "20 mm"'),
        ]},
    ),
}  # fmt: skip


class Bench:
    """One command in a separate folder, with the digests of the files of an undisturbed run.

    Parameters
    ----------
    name
        Name of the command.
    folder
        Scratch folder.
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.command = name, COMMANDS[name]
        self.folder, self.cache, self.out = folder, folder / "cache", folder / "out"
        for file in self.command.files:
            shutil.copy(ROOT / "study" / "cases" / file, folder)
        for file, changes in self.command.changes.items():
            text = (folder / file).read_text(encoding="utf-8")
            for old, new in changes:
                text = re.sub(old, new, text)
            (folder / file).write_text(text, encoding="utf-8")
        self.command.prepare(folder)
        self.clean()
        begin = time.perf_counter()
        done = self.run()
        self.seconds = time.perf_counter() - begin
        if done.returncode:
            raise RuntimeError(f"{name}: {done.stderr}")
        self.wanted = self.digests()

    def start(self, **options: object) -> "subprocess.Popen[str]":
        """Start the command."""
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "STICKSLIP_CACHE": str(self.cache)}
        words = [sys.executable, "-m", "stickslip", *self.command.words, "--out", str(self.out), "--quiet"]
        return subprocess.Popen(
            words, cwd=self.folder, env=environment, text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            **options,  # type: ignore[call-overload]
        )  # fmt: skip

    def run(self, **options: object) -> "subprocess.CompletedProcess[str]":
        """Run the command to its end."""
        process = self.start(**options)
        _, errors = process.communicate(timeout=LONGEST)
        return subprocess.CompletedProcess(self.command.words, process.returncode, "", errors)

    def clean(self) -> None:
        """Delete results, cache and histories."""
        for place in (self.cache, self.out):
            shutil.rmtree(place, ignore_errors=True)
        for history in self.folder.glob("*.history.json"):
            history.unlink()

    def digests(self) -> dict[str, str]:
        """Hashes of the result files, without times of writing."""
        return {
            str(file.relative_to(self.out)): hashlib.sha256(_content(file)).hexdigest()
            for file in sorted(self.out.rglob("*")) if file.is_file()
        }  # fmt: skip

    def stored(self) -> dict[Path, int]:
        """Stored results and their modification times [ns]."""
        return {file: file.stat().st_mtime_ns for file in (self.cache / "objects").rglob("*.npz")}

    def judge(self, before: Mapping[Path, int] | None = None) -> str:
        """Run the command again; returns a description of what is wrong, or an empty string."""
        done = self.run()
        if done.returncode or "Traceback" in done.stderr:
            return f"the same command ends with {done.returncode}: {done.stderr.strip()[-200:]}"
        result = self.digests()
        if result != self.wanted:
            other = sorted({*result.items()} ^ {*self.wanted.items()})
            return f"other files: {', '.join(dict.fromkeys(name for name, _ in other))}"
        after = self.stored()
        again = [file.name for file, written in (before or {}).items() if after.get(file) != written]
        return f"{len(again)} stored results were computed again" if again else ""


def _content(file: Path) -> bytes:
    if file.suffix == ".h5":
        import h5py

        parts: list[bytes] = []
        with h5py.File(file) as opened:
            opened.visititems(lambda name, node: parts.append(
                name.encode() + (np.asarray(node[()]).tobytes() if isinstance(node, h5py.Dataset) else b"")
            ))  # fmt: skip
        return b"".join(parts)
    if file.name == "table1.csv":
        rows = [*csv.DictReader(file.read_text(encoding="utf-8").splitlines())]
        return repr([{name: cell for name, cell in row.items() if name not in COSTS} for row in rows]).encode()
    return COST.sub(b"", TIMES.sub(b"", file.read_bytes()))


def _ends_well(code: int, errors: str, codes: set[int]) -> str:
    if code not in codes or "Traceback" in errors or "internal error of stickslip" in errors:
        return f"ended with {code}: {errors.strip()[-200:]}"
    return ""


def signals(bench: Bench, count: int, draw: random.Random) -> Iterator[tuple[str, str]]:
    """Signals at random moments, `count` of each."""
    for number in range(count * len(SIGNALS)):
        which = SIGNALS[number % len(SIGNALS)]
        bench.clean()
        moment = draw.uniform(0.1, bench.seconds)
        process = bench.start(start_new_session=True)
        with suppress(subprocess.TimeoutExpired):
            process.wait(moment)
        with suppress(ProcessLookupError):
            # A terminal sends Ctrl-C to all processes of the command; other signals go to the first process only.
            (os.killpg if which == signal.SIGINT else os.kill)(process.pid, which)
        _, errors = process.communicate(timeout=LONGEST)
        before = bench.stored()
        words = _ends_well(process.returncode, "" if which == signal.SIGKILL else errors, INTERRUPTED)
        yield which.name, words or bench.judge(before)


@contextmanager
def disk(place: Path, options: str) -> Iterator[None]:
    """Mount a small disk at a folder."""
    place.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def disks(bench: Bench, count: int, draw: random.Random) -> Iterator[tuple[str, str]]:
    """Full disks, a read-only disk and a deleted folder."""
    for _ in range(count):
        for what, place in (("full disk for results", bench.out), ("full disk for the cache", bench.cache)):
            bench.clean()
            with disk(place, f"size={draw.choice((4, 16, 64))}k"):
                done = bench.run()
                words = _ends_well(done.returncode, done.stderr, {0, 1, 2} if place == bench.cache else {0, 2})
                # No message is expected if the disk was large enough.
                told = done.returncode == 0 or "cannot be written" in done.stderr
            shutil.rmtree(place, ignore_errors=True)
            yield what, words or ("" if told else f"no sentence: {done.stderr[-200:]}") or bench.judge()
        bench.clean()
        with disk(bench.out, "size=64k,ro"):
            done = bench.run()
        yield "read-only folder", _ends_well(done.returncode, done.stderr, {2}) or bench.judge()
        bench.clean()
        process = bench.start()
        time.sleep(draw.uniform(0.3 * bench.seconds, 0.9 * bench.seconds))
        shutil.rmtree(bench.out, ignore_errors=True)
        _, errors = process.communicate(timeout=LONGEST)
        yield "folder vanishes", _ends_well(process.returncode, errors, {0, 2}) or bench.judge()


def two_at_once(bench: Bench, count: int, draw: random.Random) -> Iterator[tuple[str, str]]:
    """Two processes with one folder of results and one cache."""
    for _ in range(count):
        bench.clean()
        first = bench.start()
        time.sleep(draw.uniform(0, 0.3 * bench.seconds))
        second = bench.run()
        _, errors = first.communicate(timeout=LONGEST)
        both = ((first.returncode, errors), (second.returncode, second.stderr))
        words = "".join(_ends_well(code, text, {0}) for code, text in both)
        yield "two processes", words or bench.judge(bench.stored())


def damage(bench: Bench, count: int, draw: random.Random) -> Iterator[tuple[str, str]]:
    """A changed byte in every stored file, and results of another version."""
    for _ in range(count):
        bench.clean()
        bench.run()
        for file in bench.cache.rglob("*"):
            if file.is_file() and (content := bytearray(file.read_bytes())):
                content[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
                file.write_bytes(content)
        yield "a byte of every stored file", bench.judge()
        for file in (bench.cache / "objects").rglob("*.npz"):
            _make_older(file)
        yield "an older cache", bench.judge()


def _make_older(file: Path) -> None:
    """Change the classes of a record to ones that do not exist, with a valid checksum."""
    with zipfile.ZipFile(file) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members["tree.json"] = re.sub(rb'"(hbsolve|reduction|fe|study)\.', rb'"\1.gone.', members["tree.json"])
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name), content)
        archive.comment = bytes(64)
    body = file.read_bytes()[:-64]
    file.write_bytes(body + hashlib.sha256(body).hexdigest().encode())


def clock_set_back(bench: Bench, count: int, draw: random.Random) -> Iterator[tuple[str, str]]:
    """Files of an interrupted run have modification times a year in the future when the command runs again."""
    for _ in range(count):
        bench.clean()
        process = bench.start(start_new_session=True)
        with suppress(subprocess.TimeoutExpired):
            process.wait(draw.uniform(0.3, 1.0) * bench.seconds)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=LONGEST)
        future = time.time() + YEAR
        for place in (bench.cache, bench.out):
            for file in [*place.rglob("*"), place] if place.exists() else ():
                os.utime(file, (future, future))
        yield "the clock is set back a year", bench.judge(bench.stored())


def few_handles(bench: Bench, count: int, draw: random.Random) -> Iterator[tuple[str, str]]:
    """Fewer file handles than a run needs, or barely enough."""
    for _ in range(count):
        bench.clean()
        most = draw.choice((16, 24, 40, 64))

        def limit(most: int = most) -> None:
            resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))

        done = bench.run(preexec_fn=limit)
        yield "few file handles", _ends_well(done.returncode, done.stderr, {0, 1, 2}) or bench.judge(bench.stored())


def killed_worker(bench: Bench, count: int, draw: random.Random) -> Iterator[tuple[str, str]]:
    """Kill a process of the worker pool, if the command has started one."""
    for _ in range(count):
        bench.clean()
        process, end, killed = bench.start(), time.monotonic() + bench.seconds, False
        time.sleep(draw.uniform(0.2, 0.6) * bench.seconds)
        while not killed and time.monotonic() < end and process.poll() is None:
            for child in _workers(process.pid):
                with suppress(ProcessLookupError):
                    os.kill(child, signal.SIGKILL)
                    killed = True
                    break
            time.sleep(0.1)
        _, errors = process.communicate(timeout=LONGEST)
        before = bench.stored()
        words = _ends_well(process.returncode, errors, {0, 1} if killed else {0}) or bench.judge(before)
        yield "a worker is killed" if killed else "no worker to kill", words


def _workers(process: int) -> list[int]:
    """Descendants of a process, each after its own descendants."""
    result = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError, IndexError):
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            # Python's resource tracker does no work of the command.
            if int(fields[1]) == process and b"resource_tracker" not in (folder / "cmdline").read_bytes():
                result += [*_workers(int(folder.name)), int(folder.name)]
    return result


FAULTS: Mapping[str, Callable[[Bench, int, random.Random], Iterator[tuple[str, str]]]] = {
    "signals": signals, "disks": disks, "two processes": two_at_once, "damage": damage, "few handles": few_handles,
    "killed worker": killed_worker, "clock": clock_set_back,
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; returns 1 if anything was lost, computed again or ended in a traceback."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=17, help="moments of each fault")
    parser.add_argument("--only", nargs="*", default=[], help="commands or faults")
    given = parser.parse_args(arguments)
    names = [name for name in COMMANDS if name in given.only] or [*COMMANDS]
    faults = [name for name in FAULTS if name in given.only] or [*FAULTS]
    table: Counter[tuple[str, str, str]] = Counter()
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            bench = Bench(name, Path(folder))
            print(f"# {name}: {bench.seconds:.0f} s undisturbed", flush=True)
            for fault in faults:
                for what, words in FAULTS[fault](bench, given.count, random.Random(f"{SEED} {name} {fault}")):
                    table[name, what, "wrong" if words else "right"] += 1
                    if words:
                        print(f"{name}, {what}: {words}", flush=True)
    kinds = list(dict.fromkeys(what for _, what, _ in table))
    print("| fault | " + " | ".join(names) + " |\n|---" + "|---" * len(names) + "|")
    for what in kinds:
        cells = (
            f"{table[name, what, 'right']}/{sum(table[name, what, item] for item in ('right', 'wrong'))}"
            for name in names
        )
        print(f"| {what} | " + " | ".join(cells) + " |")
    return int(any(outcome == "wrong" for _, _, outcome in table))


if __name__ == "__main__":
    sys.exit(main())
