"""Log of the bench as commands, as Python calls, and as a script that repeats the calls on a copy of the case."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

#: Arguments of a call that are only checks, and not part of the log.
PRIVATE = frozenset({"seen", "before"})


@dataclass(frozen=True, kw_only=True)
class ScriptEntry:
    """A call in the log.

    Parameters
    ----------
    name, arguments
        Method of `study.bench.bench.Bench`, and its arguments.
    numbers
        Numbers that the call returned.
    when
        Local time, ISO 8601.
    """

    name: str
    arguments: Mapping[str, Any]
    numbers: Mapping[str, Any]
    when: str = ""


def format_command(entry: ScriptEntry, case: Path, folder: Path, without: Sequence[str] = ()) -> str:
    """Format the command that does the same as a call; a comment for a call without a command."""
    left_out = ["--without", *without] if without else []
    given = entry.arguments
    words: list[str]
    if entry.name == "add":
        values = [word for value in given.get("values", ()) for word in ("--value", value)]
        words = ["add", given["effect"], "--case", str(case), *values]
    elif entry.name == "undo":
        once = _join(["undo", "--case", str(case)])
        return "; ".join([once] * int(given.get("count", 1)))
    elif entry.name == "screen":
        return f"{_join(['diagnose', str(case), str(folder), *left_out])}  # only its screening"
    elif entry.name == "move":
        return f"# {', '.join(f'{name} = {value:.6g}' for name, value in given['values'].items())}: only predictions"
    elif entry.name == "edit":
        return f"# {case.name} was edited by hand"
    elif entry.name == "save_effect":
        return f"# {given['file']} was written beside {case.name}, which names it in [effects] files"
    elif entry.name in {"compare", "limits"}:
        words = ["compare", str(case), str(folder), *(["--limits"] if entry.name == "limits" else [])]
    else:
        words = [entry.name, str(case), str(folder), *left_out]
    return _join(words)


def format_python(entry: ScriptEntry) -> str:
    """Format the Python call that does the same."""
    given = {key: value for key, value in entry.arguments.items() if key not in PRIVATE and value not in ((), [], None)}
    return f"bench.{entry.name}({', '.join(f'{key}={value!r}' for key, value in given.items())})"


def format_script(
    entries: Sequence[ScriptEntry], case: Path, folder: Path, without: Sequence[str], text: str, history: str,
    effects: Mapping[str, str] | None = None,
) -> str:  # fmt: skip
    """Format a script that repeats all entries on a copy of the case, and prints their numbers.

    Parameters
    ----------
    entries
        Calls, oldest first.
    case, folder, without
        See `study.bench.bench.Bench`.
    text, history
        Texts of the case file and of its history before the first entry.
    effects
        Texts of changed effect files before the first entry, by name.
    """
    calls = "".join(f"        show({format_python(entry)})\n" for entry in entries)
    return f'''\
"""What was done to {case.name} in `stickslip bench`, once more on a copy of the case: it prints the same numbers.

Run it with the Python of stickslip. Results of that time are taken from the cache; without it all is computed again.
"""

from pathlib import Path

from study.bench.copied_case import copy_beside
from study.bench.repeat import open_bench, show

CASE = Path({str(case.resolve())!r})
CAMPAIGN = Path({str(folder.resolve())!r})
WITHOUT = {tuple(without)!r}
TEXT = {text!r}
HISTORY = {history!r}
EFFECTS = {dict(effects or {})!r}

# Below, because some cases are computed in several processes, which read this file as well.
if __name__ == "__main__":
    with copy_beside(CASE, TEXT, HISTORY, EFFECTS) as case:
        bench = open_bench(case, CAMPAIGN, WITHOUT, is_copy=True)
{calls}'''


def _join(words: Sequence[str]) -> str:
    return shlex.join(["stickslip", *words])
