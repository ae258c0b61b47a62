"""Text of a case file with the line of each key, and the value at a path."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from casefile.errors import Problem
from geometry.toml_position import Path

# A value longer than this is cut in messages.
LONGEST_VALUE = 60


@dataclass(frozen=True, kw_only=True)
class CaseSource:
    """The file that a case was read from.

    Parameters
    ----------
    file
        File name, as the user gave it.
    text
        Content of the file.
    data
        Content as `tomllib` reads it.
    lines
        Line of each key, by path.
    """

    file: str
    text: str
    data: Mapping[str, Any]
    lines: Mapping[Path, int]

    def problem(self, path: Path, text: str, *, show_value: bool = True) -> Problem:
        """Problem at a path; one that is not in the file gets the line of the deepest table that is."""
        known = path
        while known not in self.lines:
            known = known[:-1]
        key = dotted(path)
        written = format_value(self.data, path) if show_value else ""
        label = f"{key}{written}: " if key else ""
        return Problem(file=self.file, line=self.lines[known], key=key, text=label + text)


def dotted(path: Path) -> str:
    """Path as a user writes it: ``excitation[1].force``."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")


def format_value(data: Any, path: Path) -> str:
    """`` = "250 kg"`` for a value, nothing for a table or a key that is not there."""
    value = find_value(data, path)
    is_list_of_tables = isinstance(value, list) and any(isinstance(item, Mapping) for item in value)
    if value is None or isinstance(value, Mapping) or is_list_of_tables:
        return ""
    text = json.dumps(value, ensure_ascii=False, default=str)
    return f" = {text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 3] + '...'}"


def find_value(data: Any, path: Path) -> Any:
    """Value at a path, None without one (TOML has no null)."""
    for part in path:
        in_table = isinstance(data, Mapping) and part in data
        in_list = isinstance(data, list) and isinstance(part, int) and part < len(data)
        if not (in_table or in_list):
            return None
        data = data[part]
    return data


def find_key_in_message(message: str, table: Any, keys: Mapping[str, str]) -> str | None:
    """Key of the table that a message speaks of first, whether it writes ``root_height`` or "root height".

    Parameters
    ----------
    message
        Message of an error of a numerical package.
    table
        The table as read.
    keys
        Case key by parameter name, where they differ.
    """
    if not isinstance(table, Mapping):
        return None
    names = {key: key for key in table} | dict(keys)
    result: list[tuple[int, int, str]] = []
    for name, key in names.items():
        match = re.search(rf"(?<!\w){re.escape(name).replace('_', '[_ ]')}(?!\w)", message, re.IGNORECASE)
        if match and key in table:
            # Of two names that start together the longer is meant: "root height", not "root".
            result.append((match.start(), -len(name), key))
    return min(result)[2] if result else None
