"""Dialect of a text table, detected from its first lines: separator, decimal sign, columns, header."""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from correlation.errors import CampaignError
from correlation.file.number import MISSING, has_decimal_comma, is_written_number, read_number
from correlation.file.text_table.open_text import clean
from correlation.file.unit_label import read_unit

#: Number of lines from which the dialect is detected.
SAMPLE = 200
COMMENT = ("#", "%", "//", "!")
#: Separators, in the order of preference if they are equally good; "" is any number of blanks.
SEPARATORS = (";", "\t", ",", "|", "")
WORDS = {";": "semicolons", "\t": "tabs", ",": "commas", "|": "bars", "": "blanks"}
#: Line that announces units in the next line.
UNITS_BELOW = re.compile(r"(units?|einheit(en)?)\s*:?", re.IGNORECASE)

Line = tuple[int, str]
Row = tuple[int, list[str]]


@dataclass(frozen=True, kw_only=True)
class Dialect:
    """Dialect of the rows of a text table.

    Parameters
    ----------
    separator
        Separator between fields; empty for blanks.
    decimal_comma
        Whether the decimal sign is a comma.
    paired
        Whether commas are both separator and decimal sign, so that every number is two fields.
    closed
        Whether every row ends with a separator.
    numeric
        Whether each column has numbers, not words.
    """

    separator: str
    decimal_comma: bool
    paired: bool
    closed: bool
    numeric: tuple[bool, ...]

    def fields(self, text: str) -> list[str]:
        """Fields of a line.

        Raises
        ------
        ValueError
            A quotation mark is not closed.
        """
        fields = split_fields(text, self.separator)
        if self.closed and fields and not fields[-1].strip():
            fields.pop()
        if self.paired and len(fields) == 2 * len(self.numeric):
            return [f"{whole}.{part}" for whole, part in zip(fields[::2], fields[1::2], strict=True)]
        return fields


def split_fields(text: str, separator: str) -> list[str]:
    """Fields of a line; raises ValueError if a quotation mark is not closed."""
    if '"' not in text:
        return text.split(separator) if separator else text.split()
    try:
        rows = list(csv.reader([text], delimiter=separator or " ", strict=True, skipinitialspace=True))
    except csv.Error as error:
        raise ValueError(str(error)) from None
    return rows[0] if rows else []


def judge(file: str, sample: Sequence[Line]) -> tuple[Dialect, list[Row]]:
    """Detect the dialect and the header rows of a table.

    Parameters
    ----------
    file
        Name of the file, for messages.
    sample
        First lines with their numbers, without comments and blank lines.

    Raises
    ------
    CampaignError
        There are no rows of numbers, or the header does not fit them.
    """
    separator, comma = _find_separator(sample)
    rows = _split(file, sample, separator)
    later = rows[len(rows) // 2 :]
    width = Counter(len(fields) for _, fields in later).most_common(1)[0][0]
    closed = width > 1 and all(not fields[-1].strip() for _, fields in rows if len(fields) == width)
    width -= closed
    # A header line may lack the closing separator; a preamble has another width.
    cut = [(number, fields[:width] if closed else fields) for number, fields in rows]
    of_width = [fields for _, fields in cut[len(rows) // 2 :] if len(fields) == width]
    numeric = tuple(
        2 * sum(is_written_number(fields[column]) for fields in of_width) > len(of_width) for column in range(width)
    )
    if not any(numeric):
        raise CampaignError(f"{file}: has no column of numbers; give a table with numbers below a line of names")

    def is_data(fields: Sequence[str]) -> bool:
        # Spreadsheets export an empty line as a row of separators.
        return (
            len(fields) == width
            and "".join(fields).strip() != ""
            and all(is_written_number(field) for field, number in zip(fields, numeric, strict=True) if number)
        )

    first = next((index for index, (_, fields) in enumerate(cut) if is_data(fields)), len(cut))
    if first == len(cut):
        raise CampaignError(f"{file}: has no rows of numbers below its header")
    paired = _is_paired(cut, first, width, separator, numeric)
    header = _find_header(file, cut[:first], width // 2 if paired else width, separator)
    numeric = numeric[::2] if paired else numeric
    return Dialect(separator=separator, decimal_comma=comma, paired=paired, closed=closed, numeric=numeric), header


def _split(file: str, sample: Sequence[Line], separator: str) -> list[Row]:
    rows = []
    for number, text in sample:
        try:
            rows.append((number, split_fields(text, separator)))
        except ValueError:
            raise CampaignError(
                f'{file}, line {number}: a quotation mark (") is not closed; close or remove it'
            ) from None
    return rows


def _find_separator(sample: Sequence[Line]) -> tuple[str, bool]:
    """Separator, and whether the decimal sign is a comma: those with most numbers in rows of one length."""
    best: tuple[float, str, bool] = (-1.0, "", False)
    texts = [text for _, text in sample][len(sample) // 3 :]
    for separator in SEPARATORS:
        rows = []
        for text in texts:
            try:
                rows.append(split_fields(text, separator))
            except ValueError:
                continue
        width, count = Counter(map(len, rows)).most_common(1)[0] if rows else (0, 0)
        if width < (1 if separator == "" else 2):
            continue
        of_width = [row for row in rows if len(row) == width]
        fields = [field.strip() for row in of_width for field in row]
        comma = has_decimal_comma(of_width)
        if comma and not separator and "," in sample[0][1]:
            continue  # names between commas, or two numbers of a table without names
        numbers = sum(bool(field) and read_number(field, decimal_comma=comma) is not None for field in fields)
        share = count / len(texts) * (numbers / max(len(fields), 1)) * (1.0 if width > 1 else 0.999)
        if share > best[0] + 1e-12:
            best = (share, separator, comma)
    return best[1], best[2]


def _is_paired(rows: Sequence[Row], first: int, width: int, separator: str, numeric: Sequence[bool]) -> bool:
    """Whether rows of 2 n whole numbers follow a header of n names: commas are then separator and decimal sign."""
    if separator != "," or first == 0 or width % 2 or not all(numeric):
        return False
    if len(rows[first - 1][1]) != width // 2:
        return False
    return all(
        len(fields) == width
        and all(re.fullmatch(r"\s*[+-]?\d+", whole) for whole in fields[::2])
        and all(re.fullmatch(r"\d+(?:[eE][+-]?\d+)?\s*", part) for part in fields[1::2])
        for _, fields in rows[first:]
    )


def _find_header(file: str, above: Sequence[Row], width: int, separator: str) -> list[Row]:
    """Rows of names and units directly above the numbers; lines of another width before them are a preamble."""
    header: list[Row] = []
    if width == 1 and not separator:
        above = _find_single_names(above)
    for number, fields in reversed(above):
        written = "".join(fields).strip()
        if UNITS_BELOW.fullmatch(written) if header else not written:
            continue
        if len(fields) != width or len(header) == 3 or not written:
            break
        header.insert(0, (number, [_without_marks(clean(field.strip())) for field in fields]))
    if above and not header and width > 1 and len(above[-1][1]) > 1 and separator:
        number, fields = above[-1]
        raise CampaignError(
            f"{file}, line {number}: has {len(fields)} fields between {WORDS[separator]}, the rows below have {width}; "
            + ("are its decimals commas?" if 2 * len(fields) >= width > len(fields) else "give one name per column")
        )
    for number, fields in header[1:]:  # A damaged row of numbers is no row of units.
        wrong = next((field for field in fields if not _may_be_label(field)), None)
        if wrong is not None:
            raise CampaignError(f'{file}, line {number}: "{wrong}" is not a number; correct it')
    return header


def _find_single_names(above: Sequence[Row]) -> list[Row]:
    """Name and unit of the column of a table with one column, in which blanks do not separate fields."""
    lines = [(number, [" ".join(fields)]) for number, fields in above]
    names = [line for line in lines if not re.search(r"\w\s*[:=]\s", line[1][0])]
    return names[-2:] if names and read_unit(names[-1][1][0]) else names[-1:]


def _without_marks(field: str) -> str:
    """Field of a header; empty if it has neither letter nor digit, and is not a unit or the mark of a missing value."""
    return field if re.search(r"\w", field) or read_unit(field) or field in MISSING else ""


def _may_be_label(field: str) -> bool:
    return field.lower() in MISSING or field[:1].isalpha() or field[:1] in "[(°%µ" or bool(read_unit(field))
