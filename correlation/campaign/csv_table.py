"""CSV files with a header, commas between the fields and decimal points: columns of text and of numbers."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from correlation.errors import CampaignError


@dataclass(frozen=True, kw_only=True, eq=False)
class CsvTable:
    """Columns of text by name, and the line number of each row in the file."""

    file: str
    columns: Mapping[str, Sequence[str]]
    lines: Sequence[int]

    def problem(self, row: int, text: str) -> CampaignError:
        """Error about a row."""
        return CampaignError(f"{self.file}:{self.lines[row]}: {text}")

    def numbers(self, name: str) -> Float[NDArray[np.float64], " k"]:
        """Values of a column of finite numbers, shape (k,).

        Raises
        ------
        CampaignError
            A field is not a finite number.
        """
        column = self.columns[name]
        try:
            values = np.fromiter(map(float, column), dtype=np.float64, count=len(column))
        except ValueError:
            row = next(row for row, text in enumerate(column) if not _is_number(text))
            raise self.problem(
                row, f'{name} = "{column[row]}" is not a number; {_suggest_remedy(column[row])}'
            ) from None
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            row = int(wrong[0])
            raise self.problem(row, f'{name} = "{column[row]}" is not finite; leave out what was not measured')
        return values

    def integers(self, name: str, *, least: int) -> Int[NDArray[np.int64], " k"]:
        """Values of a column of whole numbers from `least` on, shape (k,).

        Raises
        ------
        CampaignError
            A field is not such a number.
        """
        values = self.numbers(name)
        wrong = np.flatnonzero((values != np.round(values)) | (values < least) | (values > 2**53))
        if len(wrong):
            row = int(wrong[0])
            raise self.problem(row, f'{name} = "{self.columns[name][row]}" must be a whole number from {least} on')
        return values.astype(np.int64)


def read_table(path: Path) -> CsvTable:
    """Read a CSV file; blank lines, a byte-order mark and blanks around fields are ignored.

    Raises
    ------
    CampaignError
        The file cannot be read, it has another separator or decimal commas, or a row has another number of fields than
        the header.
    """
    file = path.name
    if path.exists() and not path.is_file():
        raise CampaignError(f"{file}: is a folder or a device; give one file")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise CampaignError(
            f'{file}: there is no such file in "{path.parent}"; correct its name in the manifest'
        ) from None
    except UnicodeDecodeError:
        raise CampaignError(f"{file}: is not text in UTF-8; save it as CSV in UTF-8") from None
    except OSError as error:
        raise CampaignError(f"{file}: cannot be read ({error.strerror}); check its permissions") from None
    if "\0" in text:
        raise CampaignError(f"{file}: is not text; save it as CSV in UTF-8")
    reader = csv.reader(io.StringIO(text))
    rows: list[list[str]] = []
    lines: list[int] = []
    try:
        for row in reader:
            rows.append(row)
            lines.append(reader.line_num)
    except csv.Error as error:
        raise CampaignError(f"{file}:{reader.line_num}: is not CSV ({error}); save it with commas") from None
    if [] in rows:
        lines = [line for row, line in zip(rows, lines, strict=True) if row]
        rows = [row for row in rows if row]
    if len(rows) < 2:
        raise CampaignError(f"{file}: has no rows below a header; write a line of column names, then one a value")
    header = [name.strip() for name in rows[0]]
    for separator, word in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and separator in rows[0][0]:
            raise CampaignError(
                f"{file}:{lines[0]}: its fields are separated by {word}; save it with commas, and with decimal points"
            )
    for name in header:
        if header.count(name) > 1:
            raise CampaignError(f'{file}:{lines[0]}: two columns are called "{name}"; remove one')
    if set(map(len, rows)) != {len(header)}:
        row, line = next((row, line) for row, line in zip(rows, lines, strict=True) if len(row) != len(header))
        comma = "are its decimals commas? write points" if len(row) > len(header) else "is the row cut short?"
        raise CampaignError(f"{file}:{line}: has {len(row)} fields, the header has {len(header)}: {comma}")
    columns = zip(*rows[1:], strict=True)
    if " " in text:
        columns = zip(*([field.strip() for field in row] for row in rows[1:]), strict=True)
    return CsvTable(file=file, columns=dict(zip(header, columns, strict=True)), lines=lines[1:])


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _suggest_remedy(text: str) -> str:
    if _is_number(text.replace(",", ".", 1)):
        return "write a decimal point, not a comma"
    return "leave out what was not measured" if not text else "write one such as 1.25e-6"
