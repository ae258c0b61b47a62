"""Records of runs that write files: command, input files, time, duration and answer of each.

`Options.open` notes the output folder, `study.cli` writes the record after the answer of the command, and
`stickslip runs` reads it. Records are stored beside the stored results; only the newest of each command and output
folder is kept.
"""

import hashlib
import importlib.metadata
import json
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from geometry.errors import InputError
from pipeline.output import replace_file
from study.json_value import to_json
from study.provenance import Provenance, hash_files, make_provenance

#: Folder of the records, within the folder of stored results.
RECORDS = "runs"


@dataclass(frozen=True, kw_only=True)
class RunRecord:
    """A run that has finished.

    Parameters
    ----------
    path
        File of the record.
    command
        Words after ``stickslip``.
    folder, output
        Folder in which it was started, and its output folder.
    started, finished
        Times in UTC, as ISO 8601.
    seconds
        Wall-clock time [s].
    version, python, machine
        Version of stickslip, version of Python, and machine.
    inputs
        SHA-256 of each file or folder that the words name, and of each file that a case names.
    files
        Names of the files that the run wrote into the output folder.
    exit_code
        0, or 1 for a result that is bad.
    answer
        Document of ``--json``.
    """

    path: Path
    command: Sequence[str]
    folder: str
    output: str
    started: str
    finished: str
    seconds: float
    version: str
    python: str
    machine: str
    inputs: Mapping[str, str]
    files: Sequence[str]
    exit_code: int
    answer: Mapping[str, Any]


@dataclass
class _Run:
    """State of the command that runs."""

    words: Sequence[str]
    output: Path | None = None
    stored: Path | None = None
    files: Mapping[str, str] = field(default_factory=dict)
    """Hashes of the input files at the start: the command may change a case."""
    provenance: Provenance | None = None
    pictures: list[Path] = field(default_factory=list)
    """Files of the pictures that the command has drawn."""


_RUN: ContextVar[_Run | None] = ContextVar("the command that runs", default=None)


def note_output(output: Path, stored: Path | None) -> None:
    """Note output folder, folder of stored results and input files of the command that runs."""
    run = _RUN.get()
    if run is not None and run.words:
        run.output, run.stored, run.provenance = output.resolve(), stored, None
        run.files = hash_files(run.words)


def note_pictures(files: Iterable[Path]) -> None:
    """Note pictures that the command that runs has drawn."""
    if (run := _RUN.get()) is not None:
        run.pictures += files


def list_noted_pictures() -> list[Path]:
    """Pictures that the command that runs has drawn."""
    return [] if (run := _RUN.get()) is None else run.pictures


def get_provenance() -> Provenance | None:
    """Provenance of the command that runs; None if no command runs, such as in a Python script."""
    run = _RUN.get()
    return None if run is None else _note_provenance(run)


def _note_provenance(run: _Run) -> Provenance | None:
    if run.provenance is None and run.output is not None:
        # Folders are hashed after the command has read them, because a word may name any folder, even a whole disk.
        run.provenance = make_provenance(run.words, run.output, run.files)
    return run.provenance


@contextmanager
def recorded(words: Sequence[str]) -> Iterator[list[tuple[int, Mapping[str, Any]]]]:
    """Write a record of the command that runs within this context, if it has an output folder and an answer.

    The caller appends exit code and document of the answer to the list.
    """
    run = _Run(words)
    token = _RUN.set(run)
    started = datetime.now(UTC)
    answers: list[tuple[int, Mapping[str, Any]]] = []
    try:
        yield answers
    finally:
        _RUN.reset(token)
    if answers and run.output is not None and run.stored is not None:
        provenance = _note_provenance(run)
        assert provenance is not None
        _write(run.output, run.stored, words, provenance, started, *answers[-1])


def find_records(stored: Path, below: Path) -> list[RunRecord]:
    """List the records of runs whose output folder exists and is a given folder or below it, the oldest first.

    Parameters
    ----------
    stored
        Folder of stored results.
    below
        Given folder.
    """
    result = []
    for path in (stored / RECORDS).glob("*.json"):
        # A damaged record is ignored; the next run of the same command replaces it.
        with suppress(OSError, ValueError, KeyError, TypeError):
            document = json.loads(path.read_text(encoding="utf-8"))
            names = [item.name for item in fields(RunRecord) if item.name != "path"]
            record = RunRecord(path=path, **{name: document[name] for name in names})
            if Path(record.output).is_dir() and Path(record.output).is_relative_to(below.resolve()):
                result.append(record)
    return sorted(result, key=lambda record: record.finished)


def find_newest_record(stored: Path, output: Path) -> RunRecord:
    """Find the record of the last run that wrote into an output folder.

    Raises
    ------
    InputError
        There is no such record.
    """
    records = [item for item in find_records(stored, output) if Path(item.output) == output.resolve()]
    if not records:
        raise InputError(f"no recorded run wrote into {output}: `stickslip runs` lists the output folders")
    return records[-1]


def _write(
    output: Path,
    stored: Path,
    words: Sequence[str],
    provenance: Provenance,
    started: datetime,
    exit_code: int,
    answer: Mapping[str, Any],
) -> None:
    finished = datetime.now(UTC)
    document = {
        "command": list(words),
        "folder": str(Path.cwd()),
        "output": str(output),
        "started": started.isoformat(timespec="seconds"),
        "finished": finished.isoformat(timespec="milliseconds"),
        "seconds": round((finished - started).total_seconds(), 3),
        "version": importlib.metadata.version("stickslip"),
        "python": platform.python_version(),
        "machine": f"{platform.node()}, {platform.platform()}",
        "inputs": provenance.inputs,
        # Some file systems store only whole seconds.
        "files": [
            file.name
            for file in sorted(output.iterdir())
            if file.is_file() and file.stat().st_mtime >= int(started.timestamp())
        ],
        "exit_code": exit_code,
        "answer": to_json(answer),
    }
    key = hashlib.sha256(f"{words[0]}\0{output}".encode()).hexdigest()[:16]
    # The result is complete without its record: a full disk is not an error here.
    with suppress(OSError):
        (stored / RECORDS).mkdir(exist_ok=True)
        replace_file(stored / RECORDS / f"{key}.json", json.dumps(document, indent=1, ensure_ascii=False) + "\n")
