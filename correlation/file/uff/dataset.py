"""Splitting of a universal file into datasets, each between two lines of -1.

Binary values may contain any bytes, also those of a line of -1. The end of a binary dataset is therefore computed from
the number of its values, and a line of -1 or the end of the file must follow.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from correlation.errors import CampaignError
from correlation.file.uff.binary_values import BinaryValues, read_binary_values

DELIMITER = re.compile(rb"[ \t]{0,4}-1[ \t]*\r?$", re.MULTILINE)
IDENTIFIER = re.compile(rb"[ \t]{0,6}(\d{1,6})(?:([bB])(.*)|[ \t]*)\s*", re.DOTALL)
BLANK = re.compile(rb"(?:[ \t\0\x1a]*\r?\n)*[ \t\0\x1a\r]*\Z|(?:[ \t]*\r?\n)*")
#: Beginning of the next line of -1 in a file that is cut there.
BEGUN = re.compile(rb"[ \t]{1,4}")
#: Lines of text after the identifier of a binary dataset.
HEADER_LINES = 11


@dataclass(frozen=True, kw_only=True, eq=False)
class Dataset:
    """One dataset of a file.

    Parameters
    ----------
    file
        Name of the file.
    number
        Number of the dataset in the file, from 1.
    kind
        Number of its type, such as 58.
    line
        Line of its identifier, from 1; 0 after binary values, which have no lines.
    byte
        Offset of its identifier.
    lines
        Lines below the identifier; for a binary dataset the lines of its header.
    values
        Binary values; None for a dataset of text.
    is_closed
        Whether a whole line of -1 follows and no part of another; otherwise the file may be cut after this dataset.
    """

    file: str
    number: int
    kind: int
    line: int
    byte: int
    lines: list[bytes]
    values: BinaryValues | None = None
    is_closed: bool = True

    def where(self, row: int = -1) -> str:
        """Place of one of its lines, or of its identifier, for messages."""
        if self.line:
            return f"dataset {self.number}, line {self.line + row + 1}"
        return f"dataset {self.number} at byte {self.byte}"

    def error(self, row: int, text: str) -> CampaignError:
        """Error about one of its lines."""
        return CampaignError(f"{self.file}, {self.where(row)}: {text}")

    def text(self, row: int) -> str:
        """Text of one of its lines; raises `CampaignError` if the line does not exist."""
        if row >= len(self.lines):
            raise self.error(
                len(self.lines) - 1,
                f"type {self.kind} ends after {len(self.lines)} lines; is the file cut? export it again",
            )
        return decode(self.lines[row])

    def require_at_most(self, count: int) -> None:
        """Raise `CampaignError` if it has more lines than `count`: the delimiter of the next dataset is then lost."""
        rows = [row for row, line in enumerate(self.lines) if line.strip()]
        if len(rows) > count:
            raise self.error(
                rows[count], f'type {self.kind} has at most {count} lines; is a line "    -1" lost before this one?'
            )


def split_datasets(file: str, data: bytes) -> Iterator[Dataset]:
    """Yield the datasets of a universal file.

    Raises
    ------
    CampaignError
        There is other text between two datasets, or the length of binary values is not that of their header.
    """
    cursor, number = _Cursor(data), 0
    while cursor.skip_blank():
        number += 1
        place, first = cursor.place, cursor.take()
        # Some programs write only one line of -1 between two datasets.
        identifier = cursor.take() if DELIMITER.fullmatch(first.rstrip(b"\n")) else first
        match = IDENTIFIER.fullmatch(identifier)
        if match is None or (identifier is first and number == 1):
            raise CampaignError(
                f'{file}, {place}: "{decode(identifier.strip()[:30])}" stands where dataset {number} should begin, '
                'with a line "    -1" and the number of its type; is the file cut?'
            )
        line, byte = cursor.line - 1 if cursor.line else 0, cursor.position - len(identifier)
        dataset = Dataset(file=file, number=number, kind=int(match[1]), line=line, byte=byte, lines=[])
        if match[2]:
            dataset.lines.extend(cursor.take() for _ in range(HEADER_LINES))
            text = dataset.text(6) if dataset.kind == 58 else ""
            values = read_binary_values(dataset.error, decode(match[3]), text, data, cursor.position)
            cursor.jump(values.end)
            dataset = replace(dataset, values=values)
        else:
            dataset.lines.extend(cursor.take_until_delimiter())
        yield replace(dataset, is_closed=cursor.take_delimiter())


class _Cursor:
    """Position in a file, with its line number up to the first binary values."""

    def __init__(self, data: bytes) -> None:
        self.data, self.position, self.line = data, 0, 1

    @property
    def place(self) -> str:
        """Position for messages: line, or byte after binary values."""
        return f"line {self.line}" if self.line else f"byte {self.position}"

    def take(self) -> bytes:
        """Read the next line with its line end."""
        end = self.data.find(b"\n", self.position)
        line = self.data[self.position : end + 1] if end >= 0 else self.data[self.position :]
        self._advance(self.position + len(line))
        return line

    def take_until_delimiter(self) -> list[bytes]:
        """Read the lines up to the next line of -1, or to the end of the file."""
        start = self.position
        for match in DELIMITER.finditer(self.data, start):
            if match.start() == 0 or self.data[match.start() - 1] == 10:
                self._advance(match.start())
                break
        else:
            self._advance(len(self.data))
        return self.data[start : self.position].split(b"\n")[: None if self.position == len(self.data) else -1]

    def take_delimiter(self) -> bool:
        """Skip a line of -1, also on the line after binary values; returns whether it is whole."""
        match = re.compile(rb"(?:\r?\n)?[ \t]{0,4}-1[ \t]*(?:\r?\n|\r?\Z)").match(self.data, self.position)
        if match:
            self._advance(match.end())
        return match is not None and not BEGUN.fullmatch(self.data, self.position)

    def skip_blank(self) -> bool:
        """Skip blank lines; returns whether anything follows."""
        match = BLANK.match(self.data, self.position)
        if match:
            self._advance(match.end())
        return self.position < len(self.data)

    def jump(self, position: int) -> None:
        """Skip binary values up to an offset."""
        self.position, self.line = position, 0

    def _advance(self, position: int) -> None:
        if self.line:
            self.line += self.data.count(b"\n", self.position, position)
        self.position = position


def decode(line: bytes) -> str:
    """Text of a line in UTF-8, or else in Latin-1."""
    line = line.rstrip(b"\r\n")
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")
