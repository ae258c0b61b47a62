"""Edits of a case file: values in their places, new tables at the end; comments stay."""

import re
import tomllib
from collections.abc import Iterable, Mapping
from copy import deepcopy
from difflib import SequenceMatcher, unified_diff
from typing import TYPE_CHECKING, Any, NamedTuple

from casefile.errors import CaseError, Problem

if TYPE_CHECKING:
    from tomlkit.items import Item

#: Beginnings of a comment on a value: half its interval, or that it is a bound; one of another form is the user's, and
#: stays.
NOTE, BOUND = "+- ", "a lower bound"


class Written(NamedTuple):
    """A value as it is written: text with a unit or a bare number, and a note.

    The note is half its 95 % interval, or begins with BOUND; it is empty if neither is known.
    """

    value: str | float
    note: str = ""


Values = Mapping[str, Written]


def edited(text: str, added: Mapping[str, Values], calibrated: Values, file: str = "the case") -> str:
    """A case file with effects and calibration factors written into it.

    Parameters
    ----------
    text
        Text of the file.
    added
        Values of each effect by key; an effect that is there already gets new values.
    calibrated
        Factors by name.
    file
        Name of the file for messages.

    Raises
    ------
    CaseError
        A file whose layout does not allow it.
    """
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    mark = "\ufeff" if text.startswith("\ufeff") else ""
    plain = text.removeprefix(mark).replace("\r\n", "\n")
    wanted = _wanted(tomllib.loads(plain), added, calibrated)
    try:
        document: Any = tomlkit.parse(plain)
        new = _written(document.get("calibrated"), "[calibrated]", calibrated) if calibrated else ""
        for effect, values in added.items():
            table = _table_of(effect, document.get("added", []))
            new += _written(table, f'[[added]]\neffect = "{_escaped(effect)}"', values)
        result = tomlkit.dumps(document)
    except TOMLKitError as error:
        raise _refusal(file, str(error)) from error
    if new:
        result = f"{result.rstrip()}\n{new}"
    try:
        sound = tomllib.loads(result) == wanted
    except tomllib.TOMLDecodeError:
        sound = False
    if not sound:
        raise _refusal(file, "its tables are laid out in a way that cannot be edited")
    return mark + (result.replace("\n", "\r\n") if "\r\n" in text else result)


def difference(before: str, after: str, file: str) -> list[str]:
    """Lines of a unified diff."""
    lines = unified_diff(before.splitlines(), after.splitlines(), file, file, "before", "after", n=1, lineterm="")
    return list(lines)


def taken_back(before: str, after: str, current: str) -> str | None:
    """The current text with the change from `before` to `after` undone; None if these very lines were edited since."""
    if current == after:
        return before
    old, new, now = (text.splitlines(keepends=True) for text in (before, after, current))
    blocks = SequenceMatcher(None, new, now, autojunk=False).get_matching_blocks()
    result = list(now)
    for tag, first, last, start, end in reversed(SequenceMatcher(None, new, old, autojunk=False).get_opcodes()):
        if tag == "equal":
            continue
        # The lines of the change must stand as they were, with at least one neighbour, so that their place is certain.
        whole = [
            block
            for block in blocks
            if block.a <= first and last <= block.a + block.size and (first < last or block.size)
        ]
        if not whole:
            return None
        shift = whole[0].b - whole[0].a
        result[first + shift : last + shift] = old[start:end]
    return "".join(result)


def _wanted(data: dict[str, Any], added: Mapping[str, Values], calibrated: Values) -> dict[str, Any]:
    """Content of the file after the edit."""
    data = deepcopy(data)
    for effect, values in added.items():
        tables = data.setdefault("added", [])
        table = _table_of(effect, tables)
        if table is None:
            tables.append(table := {"effect": effect})
        table |= {key: item.value for key, item in values.items()}
    if calibrated:
        data.setdefault("calibrated", {}).update({key: item.value for key, item in calibrated.items()})
    return data


def _written(table: Any, header: str, values: Values) -> str:
    """Write values into a table of the document; the text of a new table where there is none."""
    if table is None:
        lines = [header]
        for key, (value, note) in values.items():
            text = f'"{_escaped(value)}"' if isinstance(value, str) else repr(value)
            lines.append(f"{key} = {text}{f' # {_comment(note)}' if note else ''}")
        return "\n" + "".join(f"{line}\n" for line in lines)
    for key, (value, note) in values.items():
        before = table[key].trivia.comment if key in table else ""
        table[key] = value
        item: Item = table[key]
        is_note = before.lstrip("# ").startswith((NOTE, BOUND))
        if note and (not before or is_note):
            item.comment(_comment(note))
        elif is_note:  # the interval of another value
            item.trivia.comment, item.trivia.comment_ws = "", ""
    return ""


def _comment(note: str) -> str:
    return note if note.startswith(BOUND) else NOTE + note


def _table_of(effect: str, tables: Iterable[Any]) -> Any:
    """The table of an effect; None if there is none."""
    names = [(" ".join(str(table.get("effect", "")).split()).casefold(), table) for table in tables]
    return dict(reversed(names)).get(" ".join(effect.split()).casefold())


def _escaped(text: str) -> str:
    return re.sub(r'(["\\])', r"\\\1", text)


def _refusal(file: str, reason: str) -> CaseError:
    text = f"cannot be edited ({reason}): write the effect into it by hand, as docs/diagnose.md shows"
    return CaseError([Problem(file=file, line=0, key="", text=text)])
