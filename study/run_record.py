"""A record of each run that writes files: what was run on which files, when, for how long, and its answer.

`Options.open` notes the output folder, `study.cli` writes the record when the command has answered, `stickslip runs`
reads it. Records lie beside the stored results, one per command and output folder: the newest.
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

#: Folder of the records, within that of the stored results.
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
        Where it was started, and its output folder.
    started, finished
        Times in UTC, as ISO 8601.
    seconds
        Wall-clock time [s].
    version, python, machine
        With what it ran.
    inputs
        SHA-256 of each file or folder that the words name, and of files that a case names.
    files
        Names of the files that it wrote into the output folder.
    exit_code
        0, or 1 for a result that is bad.
    answer
        The document of ``--json``.
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
    """What is known of the command that runs."""

    words: Sequence[str]
    output: Path | None = None
    stored: Path | None = None
    files: Mapping[str, str] = field(default_factory=dict)
    """Hashes of its input files as it found them: it may write a case."""
    provenance: Provenance | None = None
    pictures: list[Path] = field(default_factory=list)
    """Files of the pictures that it has drawn."""


_RUN: ContextVar[_Run | None] = ContextVar("the command that runs", default=None)


def note_output(output: Path, stored: Path | None) -> None:
    """Note the output folder of the command that runs, the folder of stored results, and the files that it reads."""
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
    """What the result of the command that runs is made by; None in Python."""
    run = _RUN.get()
    return None if run is None else _note_provenance(run)


def _note_provenance(run: _Run) -> Provenance | None:
    if run.provenance is None and run.output is not None:
        # Folders are hashed when the command has read them: any folder can be named, such as a whole disk.
        run.provenance = make_provenance(run.words, run.output, run.files)
    return run.provenance


@contextmanager
def recorded(words: Sequence[str]) -> Iterator[list[tuple[int, Mapping[str, Any]]]]:
    """Write a record of the command that runs within, if it has an output folder and answers.

    The list takes the exit code and the document of the answer.
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
    """Records of runs whose output folder is a folder or below it and still there, the oldest first.

    Parameters
    ----------
    stored
        Folder of stored results.
    below
        The folder.
    """
    result = []
    for path in (stored / RECORDS).glob("*.json"):
        # One that is damaged says nothing, and the next run of the same command replaces it.
        with suppress(OSError, ValueError, KeyError, TypeError):
            document = json.loads(path.read_text(encoding="utf-8"))
            names = [item.name for item in fields(RunRecord) if item.name != "path"]
            record = RunRecord(path=path, **{name: document[name] for name in names})
            if Path(record.output).is_dir() and Path(record.output).is_relative_to(below.resolve()):
                result.append(record)
    return sorted(result, key=lambda record: record.finished)


def find_newest_record(stored: Path, output: Path) -> RunRecord:
    """Record of the last run that wrote into an output folder.

    Raises
    ------
    InputError
        There is none.
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
        # Some file systems keep whole seconds alone.
        "files": [
            file.name
            for file in sorted(output.iterdir())
            if file.is_file() and file.stat().st_mtime >= int(started.timestamp())
        ],
        "exit_code": exit_code,
        "answer": to_json(answer),
    }
    key = hashlib.sha256(f"{words[0]}\0{output}".encode()).hexdigest()[:16]
    # The result is there without its record: a full disk is no error here.
    with suppress(OSError):
        (stored / RECORDS).mkdir(exist_ok=True)
        replace_file(stored / RECORDS / f"{key}.json", json.dumps(document, indent=1, ensure_ascii=False) + "\n")
