"""What a page, or the record of a run, says that it was made by, and what it found."""

import html
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geometry.errors import InputError
from study.provenance import Provenance, list_result_words
from study.run_record import find_newest_record

RUN = re.compile(r'<meta name="stickslip-run" content="([^"]*)">')
DATA = re.compile(r"<script>const DATA = (\{[^<]*\});</script>")
#: What is no text for a reader, or changes with the version alone.
UNREAD = re.compile(r"<(script|style|footer|head)\b.*?</\1>", re.DOTALL)
#: What a result took, in cells of a page: another each time, like such values of an answer and names of its files.
COST = re.compile(r'<td class="cost">[^<]*</td>')
NO_RESULT = {"files", "seconds", "memory_bytes"}
#: When the steps of a history were made.
TIME = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d")
TAG = re.compile(r"<[^>]*>")


@dataclass(frozen=True, kw_only=True)
class RepeatableResult:
    """A result that can be repeated.

    Parameters
    ----------
    provenance
        What it was made by.
    folder
        Where its command was started, as far as is known.
    values
        What it found: the data and text of a page, or the answer of a command.
    """

    provenance: Provenance
    folder: Path
    values: Mapping[str, Any]


def read_result(path: Path, stored: Path) -> RepeatableResult:
    """A page, or an output folder whose last run is on record.

    Parameters
    ----------
    path
        HTML file or folder.
    stored
        Folder of stored results, which has the records.

    Raises
    ------
    InputError
        Neither, or a page that does not say what it was made by.
    """
    if path.is_dir():
        return _read_record(path, stored)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not a text file"
        raise InputError(f"{path} cannot be read ({reason}): name a page of stickslip, or an output folder") from error
    match = RUN.search(text)
    try:
        provenance = None if match is None else Provenance(**json.loads(html.unescape(match[1])))
        if provenance is not None:
            _check(provenance)
        data = DATA.search(text)
        values = {"data": json.loads(data[1]) if data else {}, "text": _list_text_lines(text)}
    except (ValueError, TypeError, RecursionError):
        raise InputError(f"{path} is damaged: the record of the command that made it cannot be read") from None
    if provenance is None:
        raise InputError(f"{path} does not contain the command that made it: name a page written by this version")
    return RepeatableResult(
        provenance=provenance, folder=Path(os.path.normpath(path.parent / provenance.folder)), values=values
    )


def _read_record(path: Path, stored: Path) -> RepeatableResult:
    record = find_newest_record(stored, path)
    folder = Path(record.folder)
    made_by = Provenance(
        command=list_result_words(record.command), folder=os.path.relpath(folder, path.resolve()), inputs=record.inputs,
        versions={"stickslip": record.version, "python": record.python},
    )  # fmt: skip
    return RepeatableResult(provenance=made_by, folder=folder, values=keep_results(record.answer))


def keep_results(answer: Any) -> Any:
    """An answer without names of files and without what it took."""
    if isinstance(answer, Mapping):
        return {name: keep_results(value) for name, value in answer.items() if name not in NO_RESULT}
    return [keep_results(item) for item in answer] if isinstance(answer, list | tuple) else answer


def _list_text_lines(text: str) -> list[str]:
    body = TIME.sub("", TAG.sub("\n", COST.sub("", UNREAD.sub("", text))))
    return [line.strip() for line in html.unescape(body).splitlines() if line.strip()]


def _check(provenance: Provenance) -> None:
    """Raise TypeError unless all is of its type."""
    texts = [*provenance.command, provenance.folder, *provenance.inputs.items(), *provenance.versions.items()]
    flat = [part for item in texts for part in ([item] if isinstance(item, str) else item)]
    if not provenance.command or not all(isinstance(part, str) for part in flat):
        raise TypeError
