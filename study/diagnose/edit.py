"""A case file changed as a careful engineer would: values in their places, new tables at the end, comments kept."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from copy import deepcopy
from difflib import SequenceMatcher, unified_diff
from typing import TYPE_CHECKING, Any, NamedTuple

from casefile.errors import CaseError, Problem

if TYPE_CHECKING:
    from tomlkit.items import Item

#: How a deviation is noted behind a value; a comment of another form is the user's, and stays.
NOTE = "+- "


class Written(NamedTuple):
    """A value as it is written: text with a unit or a bare number, and half its 95 % interval, empty if unknown."""

    value: str | float
    note: str = ""


Values = Mapping[str, Written]


def edited(text: str, added: Mapping[str, Values], calibrated: Values, file: str = "the case") -> str:
    """A case file with effects and calibrated factors written into it.

    Parameters
    ----------
    text
        Of the file.
    added
        Values of each effect by key; one that is there already gets new values.
    calibrated
        Factors by name.
    file
        For messages.

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
        new = _calibrate(document, calibrated)
        new += "".join(_add(document, effect, values) for effect, values in added.items())
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
    """What the file must say in the end."""
    data = deepcopy(data)
    for effect, values in added.items():
        tables = data.setdefault("added", [])
        table = next((item for item in tables if _same(item.get("effect", ""), effect)), None)
        if table is None:
            tables.append(table := {"effect": effect})
        table |= {key: item.value for key, item in values.items()}
    if calibrated:
        data.setdefault("calibrated", {}).update({key: item.value for key, item in calibrated.items()})
    return data


def _calibrate(document: Any, calibrated: Values) -> str:
    """Write factors where the table is; else the text of a new table."""
    if not calibrated:
        return ""
    if "calibrated" in document:
        for key, item in calibrated.items():
            _set(document["calibrated"], key, item)
        return ""
    return f"\n[calibrated]\n{_lines(calibrated)}"


def _add(document: Any, effect: str, values: Values) -> str:
    """Write values where the effect is; else the text of a new table."""
    tables: Sequence[Any] = document.get("added", [])
    for table in tables:
        if _same(str(table.get("effect", "")), effect):
            for key, item in values.items():
                _set(table, key, item)
            return ""
    return f'\n[[added]]\neffect = "{_escaped(effect)}"\n{_lines(values)}'


def _set(table: Any, key: str, written: Written) -> None:
    new = key not in table
    note = "" if new else table[key].trivia.comment
    table[key] = written.value
    item: Item = table[key]
    if written.note and (not note or note.lstrip("# ").startswith(NOTE)):
        item.comment(NOTE + written.note)


def _lines(values: Values) -> str:
    shown = {key: f'"{_escaped(v.value)}"' if isinstance(v.value, str) else repr(v.value) for key, v in values.items()}
    return "".join(
        f"{key} = {shown[key]}{f' # {NOTE}{item.note}' if item.note else ''}\n" for key, item in values.items()
    )


def _same(name: str, other: str) -> bool:
    return " ".join(name.split()).casefold() == " ".join(other.split()).casefold()


def _escaped(text: str) -> str:
    return re.sub(r'(["\\])', r"\\\1", text)


def _refusal(file: str, reason: str) -> CaseError:
    text = f"cannot be edited ({reason}): write the effect into it by hand, as docs/diagnose.md shows"
    return CaseError([Problem(file=file, line=0, key="", text=text)])
