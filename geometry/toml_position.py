"""Find the line of each key of a TOML document.

`tomllib` reads the values but does not keep the lines. This module scans the text again, after `tomllib` has accepted
it, and therefore need not check the grammar: it only finds the ends of keys, strings and brackets.
"""

import re
import tomllib
from bisect import bisect_right
from typing import TypeAlias

# The key of a table or the index of an array's element at each level, as in pydantic's error locations.
Path: TypeAlias = tuple[str | int, ...]

_SPACE = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
# A scalar without quotes may contain one space, between a date and its time.
_BARE_VALUE = re.compile(r"[^\s,\]}#]+(?:[ ]\d\d:[^\s,\]}#]+)?")
# Multi-line strings end at the last three of up to five quotes, hence the look-ahead.
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?!")|'
    r"'''.*?'''(?!')|"
    r'"(?:\\.|[^"\\\n])*"|'
    r"'[^'\n]*'",
    re.DOTALL,
)


def key_lines(text: str) -> dict[Path, int]:
    """Line of every key, table and array element of a valid TOML document.

    Parameters
    ----------
    text
        A document that `tomllib.loads` accepts.

    Returns
    -------
    Lines counted from 1 by path, such as ``("excitation", 1, "force")``. The line of a table is that of its header; a
    table without a header, from dotted keys or deeper headers, has the line of the first of these. The document itself,
    ``()``, has line 1.
    """
    return _TomlScanner(text).lines


def explain_syntax(message: str, text: str) -> tuple[str, int]:
    """Explain the error of a document that is not valid TOML.

    Parameters
    ----------
    message
        Message of `tomllib`, such as "Expected ... (at line 3, column 5)".
    text
        The document.

    Returns
    -------
    A sentence and the line, counted from 1.
    """
    match = re.fullmatch(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", message, re.DOTALL)
    if match is None:
        return f"this is not valid TOML: {message}", 1
    words, line, column = match.groups()
    number = int(line) if line else text.rstrip("\n").count("\n") + 1
    source = (text.splitlines() or [""])[number - 1 : number] or [""]
    where = f" in column {column}" if column else " at the end of the file"
    hint = ""
    if words.startswith(("Cannot overwrite", "Cannot declare")):
        hint = "; it appears twice: remove one"
    elif "=" in source[0] and words.startswith(("Expected newline", "Invalid value")):
        hint = '; put text and values with units in quotes, e.g. "tip" and "250 mm"'
    return f"this is not valid TOML: {words[0].lower()}{words[1:]}{where} of: {source[0].strip()}{hint}", number


class _TomlScanner:
    """Scanner of a document, which keeps the current position."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.newlines = [match.start() for match in re.finditer("\n", text)]
        self.lines: dict[Path, int] = {(): 1}
        # Number of elements so far of each array of tables; a later header refers to the last element.
        self.array_length: dict[Path, int] = {}
        self._document()

    def _document(self) -> None:
        table: Path = ()
        self._skip()
        while self.at < len(self.text):
            if self.text[self.at] == "[":
                table = self._header()
            else:
                self._pair(table)
            self._skip()

    def _header(self) -> Path:
        start = self.at
        is_array = self.text.startswith("[[", self.at)
        self.at += 2 if is_array else 1
        keys = self._dotted_key()
        self.at += 2 if is_array else 1
        path: Path = ()
        for _, key in keys[:-1]:
            path = self._last_element((*path, key))
            self.lines.setdefault(path, self._line(start))
        path = (*path, keys[-1][1])
        if is_array:
            index = self.array_length.get(path, 0)
            self.array_length[path] = index + 1
            self.lines.setdefault(path, self._line(start))
            path = (*path, index)
        # An explicit header replaces the line of an earlier [a.b] that only implied this table.
        self.lines[path] = self._line(start)
        return path

    def _last_element(self, path: Path) -> Path:
        return (*path, self.array_length[path] - 1) if path in self.array_length else path

    def _pair(self, table: Path) -> None:
        path = table
        for start, key in self._dotted_key():
            path = (*path, key)
            self.lines.setdefault(path, self._line(start))
        self._skip()
        self.at += 1  # the equals sign
        self._skip()
        self._value(path)

    def _value(self, path: Path) -> None:
        if self.text[self.at] == "[":
            self._array(path)
        elif self.text[self.at] == "{":
            self._inline_table(path)
        else:
            self._scalar()

    def _array(self, path: Path) -> None:
        self.at += 1
        index = 0
        while self._next() != "]":
            self.lines[(*path, index)] = self._line(self.at)
            self._value((*path, index))
            index += 1
            if self._next() == ",":
                self.at += 1
        self.at += 1

    def _inline_table(self, path: Path) -> None:
        self.at += 1
        while self._next() != "}":
            self._pair(path)
            if self._next() == ",":
                self.at += 1
        self.at += 1

    def _scalar(self) -> None:
        match = _STRING.match(self.text, self.at) or _BARE_VALUE.match(self.text, self.at)
        assert match is not None, f"no value at line {self._line(self.at)}: was the document checked by tomllib?"
        self.at = match.end()

    def _dotted_key(self) -> list[tuple[int, str]]:
        keys = [self._key()]
        while self._next() == ".":
            self.at += 1
            keys.append(self._key())
        return keys

    def _key(self) -> tuple[int, str]:
        self._skip()
        start = self.at
        bare = _BARE_KEY.match(self.text, start)
        if bare:
            self.at = bare.end()
            return start, bare.group()
        quoted = _STRING.match(self.text, start)
        assert quoted is not None, f"no key at line {self._line(start)}: was the document checked by tomllib?"
        self.at = quoted.end()
        # tomllib decodes escapes.
        return start, str(tomllib.loads(f"key = {quoted.group()}")["key"])

    def _next(self) -> str:
        self._skip()
        return self.text[self.at : self.at + 1]

    def _skip(self) -> None:
        match = _SPACE.match(self.text, self.at)
        assert match is not None  # the pattern also matches an empty text
        self.at = match.end()

    def _line(self, position: int) -> int:
        return bisect_right(self.newlines, position - 1) + 1
