"""Provenance and values of a result, read from a page or from the record of a run."""

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
#: Elements of a page that are not compared: they are not text for a reader, or depend only on the version.
UNREAD = re.compile(r"<(script|style|footer|head)\b.*?</\1>", re.DOTALL)
#: Table cells with time or memory, and keys of an answer with time, memory or file names: they differ between runs.
COST = re.compile(r'<td class="cost">[^<]*</td>')
NO_RESULT = {"files", "seconds", "memory_bytes"}
#: Time stamps of history steps, which are not compared.
TIME = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d")
TAG = re.compile(r"<[^>]*>")


@dataclass(frozen=True, kw_only=True)
class RepeatableResult:
    """Result that can be repeated.

    Parameters
    ----------
    provenance
        Command, inputs and versions that made the result.
    folder
        Folder in which its command was started, according to the record.
    values
        Values of the result: data and text of a page, or the answer of a command.
    """

    provenance: Provenance
    folder: Path
    values: Mapping[str, Any]


def read_result(path: Path, stored: Path) -> RepeatableResult:
    """Read a result from a page, or from the newest record of a run into an output folder.

    Parameters
    ----------
    path
        HTML file or folder.
    stored
        Folder of stored results, which contains the records.

    Raises
    ------
    InputError
        If the file cannot be read, or has no provenance or a damaged one, or the folder has no record.
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
    """Answer without file names, time and memory."""
    if isinstance(answer, Mapping):
        return {name: keep_results(value) for name, value in answer.items() if name not in NO_RESULT}
    return [keep_results(item) for item in answer] if isinstance(answer, list | tuple) else answer


def _list_text_lines(text: str) -> list[str]:
    body = TIME.sub("", TAG.sub("\n", COST.sub("", UNREAD.sub("", text))))
    return [line.strip() for line in html.unescape(body).splitlines() if line.strip()]


def _check(provenance: Provenance) -> None:
    """Raise TypeError if the command is empty or a value is not text."""
    texts = [*provenance.command, provenance.folder, *provenance.inputs.items(), *provenance.versions.items()]
    flat = [part for item in texts for part in ([item] if isinstance(item, str) else item)]
    if not provenance.command or not all(isinstance(part, str) for part in flat):
        raise TypeError
