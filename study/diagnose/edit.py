"""Edits of a case file: values in their places, new tables at the end; comments are kept."""

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from difflib import SequenceMatcher, unified_diff
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from casefile.errors import CaseError, Problem

if TYPE_CHECKING:
    from tomlkit.items import Item

#: Beginnings of a comment on a value: half its interval, or that it is a bound. Any other comment is the user's and is
#: kept.
NOTE, BOUND, UPPER = "+- ", "a lower bound", "an upper bound"
#: A line that begins a table.
HEADER = re.compile(r"^[ \t]*\[", re.MULTILINE)


class Written(NamedTuple):
    """A value in written form: text with a unit or a bare number, and a note.

    The note is half its 95 % interval, or begins with BOUND or UPPER; it is empty if neither is known.
    """

    value: str | float
    note: str = ""


Values = Mapping[str, Written]


def edit_case(text: str, added: Mapping[str, Values], calibrated: Values, file: str = "the case") -> str:
    """A case file with effects and calibration factors written into it.

    Parameters
    ----------
    text
        Text of the file.
    added
        Values of each effect by key; an effect of the case gets new values.
    calibrated
        Factors by name.
    file
        Name of the file for messages.

    Raises
    ------
    CaseError
        A file whose layout does not allow it.
    """
    try:
        return edit_tables(
            text,
            lambda before: _edit_data(before, added, calibrated),
            lambda pieces: _with_values(pieces, added, calibrated),
        )
    except UneditableLayout as error:
        raise _make_editing_error(file, str(error)) from None


class UneditableLayout(ValueError):
    """The layout of the tables of a file cannot be edited."""


def edit_tables(
    text: str, change: Callable[[dict[str, Any]], dict[str, Any]], write: Callable[[Sequence[str]], str]
) -> str:
    """A TOML file with some of its tables changed; all others are kept, with their comments.

    Parameters
    ----------
    text
        Text of the file.
    change
        Maps the content of the file to the wanted content.
    write
        Maps the pieces of the file, each of which begins with a table, to the new text.

    Raises
    ------
    UneditableLayout
        The written text does not have the wanted content.
    """
    from tomlkit.exceptions import TOMLKitError

    mark = "\ufeff" if text.startswith("\ufeff") else ""
    plain = text.removeprefix(mark).replace("\r\n", "\n")
    wanted = change(tomllib.loads(plain))
    # First edit single tables, which keeps all others; then the whole file, whose tables may be reordered.
    bounds = [0, *(match.start() for match in HEADER.finditer(plain)), len(plain)]
    reason = "its tables are laid out in a way that cannot be edited"
    for pieces in ([plain[first:last] for first, last in pairwise(bounds)], [plain]):
        try:
            result = write(pieces)
            if tomllib.loads(result) == wanted:
                return mark + (result.replace("\n", "\r\n") if "\r\n" in text else result)
        except tomllib.TOMLDecodeError:
            continue
        except TOMLKitError as error:
            reason = str(error)
    raise UneditableLayout(reason)


def _with_values(pieces: Sequence[str], added: Mapping[str, Values], calibrated: Values) -> str:
    """Pieces of a file, each valid TOML, with values in the existing tables, or in new ones at the end.

    Raises
    ------
    TOMLKitError
        A piece that cannot be parsed or edited.
    """
    import tomlkit

    written, new = list(pieces), ""
    tables: list[tuple[str | None, Values]] = [(None, calibrated)] if calibrated else []
    for effect, values in [*tables, *added.items()]:
        key = "calibrated" if effect is None else "added"
        for number, piece in enumerate(written):
            if key not in piece:
                continue
            document: Any = tomlkit.parse(piece)
            table = document.get(key) if effect is None else _find_table(effect, document.get(key, []))
            if table is not None:
                _write_table(table, "", values)
                written[number] = tomlkit.dumps(document)
                break
        else:
            header = "[calibrated]" if effect is None else f'[[added]]\neffect = "{_escape(effect)}"'
            new += _write_table(None, header, values)
    result = "".join(written)
    return f"{result.rstrip()}\n{new}" if new else result


def list_changes(before: str, after: str, file: str) -> list[str]:
    """Lines of a unified diff."""
    lines = unified_diff(before.splitlines(), after.splitlines(), file, file, "before", "after", n=1, lineterm="")
    return list(lines)


def revert_change(before: str, after: str, current: str) -> str | None:
    """The current text with the change from `before` to `after` undone; None if its lines were edited since."""
    if current == after:
        return before
    old, new, now = (text.splitlines(keepends=True) for text in (before, after, current))
    blocks = SequenceMatcher(None, new, now, autojunk=False).get_matching_blocks()
    result = list(now)
    for tag, first, last, start, end in reversed(SequenceMatcher(None, new, old, autojunk=False).get_opcodes()):
        if tag == "equal":
            continue
        # The lines of the change must be unedited; if it left none, a neighbour must be, so that their place is
        # certain.
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


def _edit_data(data: dict[str, Any], added: Mapping[str, Values], calibrated: Values) -> dict[str, Any]:
    """Content of the file after the edit."""
    data = deepcopy(data)
    for effect, values in added.items():
        tables = data.setdefault("added", [])
        table = _find_table(effect, tables)
        if table is None:
            tables.append(table := {"effect": effect})
        table |= {key: item.value for key, item in values.items()}
    if calibrated:
        data.setdefault("calibrated", {}).update({key: item.value for key, item in calibrated.items()})
    return data


def _write_table(table: Any, header: str, values: Values) -> str:
    """Write values into a table of the document; text of a new table without one."""
    if table is None:
        lines = [header]
        for key, (value, note) in values.items():
            text = f'"{_escape(value)}"' if isinstance(value, str) else repr(value)
            lines.append(f"{_quote_key(key)} = {text}{f' # {_format_comment(note)}' if note else ''}")
        return "\n" + "".join(f"{line}\n" for line in lines)
    for key, (value, note) in values.items():
        before = table[key].trivia.comment if key in table else ""
        table[key] = value
        item: Item = table[key]
        is_note = before.lstrip("# ").startswith((NOTE, BOUND, UPPER))
        if note and (not before or is_note):
            item.comment(_format_comment(note))
        elif is_note:  # the interval of another value
            item.trivia.comment, item.trivia.comment_ws = "", ""
    return ""


def _format_comment(note: str) -> str:
    return note if note.startswith((BOUND, UPPER)) else NOTE + note


def _find_table(effect: str, tables: Iterable[Any]) -> Any:
    """The table of an effect, or None."""
    names = [(" ".join(str(table.get("effect", "")).split()).casefold(), table) for table in tables]
    return dict(reversed(names)).get(" ".join(effect.split()).casefold())


def _quote_key(name: str) -> str:
    """A key in TOML: in quotes if it contains a dot, which would begin a table."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else f'"{_escape(name)}"'


def _escape(text: str) -> str:
    return re.sub(r'(["\\])', r"\\\1", text)


def _make_editing_error(file: str, reason: str) -> CaseError:
    text = f"cannot be edited ({reason}): write the effect into it by hand, as docs/diagnose.md shows"
    return CaseError([Problem(file=file, line=0, key="", text=text)])
