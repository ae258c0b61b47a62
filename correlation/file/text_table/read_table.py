"""Reader of text tables, in blocks of rows: columns of numbers, and columns of words as indices."""

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, make_unique_names
from correlation.file.number import is_written_number, may_part_thousands, read_number
from correlation.file.quantity import OF_UNIT
from correlation.file.text_table.date_time import read_date_times
from correlation.file.text_table.dialect import COMMENT, SAMPLE, WORDS, Dialect, Line, Row, judge, split_fields
from correlation.file.text_table.footer import skip_footer
from correlation.file.text_table.open_text import clean, open_text
from correlation.file.unit_label import read_unit, split_label, split_unit_cell

#: Number of rows that are converted together, which limits the text in memory.
BLOCK = 20_000
#: Fact of a file whose decimals may be groups of thousands.
DECIMALS = "decimals"
#: Largest length of a line of a table [characters].
LONGEST = 1_000_000
#: Key of the unit of the first column.
AXIS_UNIT = re.compile(r"(x[- ]?)?ax[ie]s ?unit|x[- ]?unit")
KEY_VALUE = re.compile(r"^\W*([\w][\w .()/-]{0,40}?)\s*[:=;,\t]\s*(.{1,200}?)[\s;,]*$")


def read_table(path: Path, *, format_name: str) -> MeasuredFile:
    """Read the columns of a text table.

    Parameters
    ----------
    path
        Path of the file, plain or gzip.
    format_name
        Name of the format.

    Raises
    ------
    CampaignError
        A row has another number of fields, a field is not a number, or there is no table: with file and line.
    """
    with open_text(path) as stream:
        comments: list[str] = []
        lines = _read_lines(path.name, stream, comments)
        sample = list(itertools.islice(lines, SAMPLE))
        if len(sample) > 2 and all(_unquote_line(text) is not None for _, text in sample):
            lines = ((number, _unquote_line(text) or text) for number, text in lines)
            sample = [(number, _unquote_line(text) or text) for number, text in sample]
        if not sample:
            raise CampaignError(f"{path.name}: has no rows; give a table with numbers below a line of names")
        remarks = list(comments)
        dialect, header = judge(path.name, sample)
        first = header[-1][0] if header else 0
        preamble = [text for number, text in sample if number < (header[0][0] if header else 0)]
        if not header:
            header = _find_commented_header(remarks, dialect)
            preamble = _find_preamble_without_header(sample, dialect)
            first = sample[len(preamble) - 1][0] if preamble else 0
        body: Iterator[Line] = itertools.chain((line for line in sample if line[0] > first), lines)
        below: dict[str, str] = {}
        body = skip_footer(path.name, body, dialect, below)
        blocks = _Blocks(path.name, dialect)
        while rows := list(itertools.islice(body, BLOCK)):
            blocks.add(rows)
    names, units, labels, cells = _split_names_and_units(header, len(dialect.numeric))
    columns = tuple(
        read_date_times(
            Column(
                name=name, values=values, unit=unit, label=label, unit_label=cell, words=words,
                where=f"column {number + 1}",
            )
        )
        for number, (name, unit, label, cell, (values, words)) in enumerate(
            zip(names, units, labels, cells, blocks.columns(), strict=True)
        )
    )  # fmt: skip
    facts = {"separator": WORDS[dialect.separator], **_find_facts([*remarks, *map(clean, preamble)]), **below}
    columns = _with_axis_unit(columns, facts)
    if dialect.decimal_comma or dialect.paired:
        facts["decimal sign"] = "comma"
    if doubt := _doubt_decimals(sample, first, dialect):
        facts[DECIMALS] = doubt
    return MeasuredFile(path=path, format=format_name, title=facts.get("title", ""), columns=columns, facts=facts)


def _with_axis_unit(columns: tuple[Column, ...], facts: Mapping[str, str]) -> tuple[Column, ...]:
    """Give a first column without name and unit the unit of the axis in a line above the table: "AxisUnit;Hz"."""
    label = next((text for key, text in facts.items() if AXIS_UNIT.fullmatch(key)), "")
    first = columns[0]
    if not read_unit(label) or first.unit or first.name != "column 1" or len(columns) < 2:
        return columns
    return replace(first, unit=read_unit(label), unit_label=label), *columns[1:]


def _unquote_line(text: str) -> str | None:
    """Line that a spreadsheet put into quotation marks as one field, without these marks; None for another line."""
    line = text.strip()
    if len(line) < 2 or line[0] != '"' or line[-1] != '"':
        return None
    inside = line[1:-1].replace('""', "")
    has_several = any(separator in inside for separator in ",;\t") and '"' not in inside
    return line[1:-1].replace('""', '"') if has_several else None


def _read_lines(file: str, stream: IO[str], comments: list[str]) -> Iterator[Line]:
    """Yield lines with their numbers; comments go to `comments`, blank lines are left out."""
    number = 0
    while text := stream.readline(LONGEST):
        number += 1
        if len(text) >= LONGEST:
            raise CampaignError(f"{file}, line {number}: is longer than {LONGEST} characters; give a table of text")
        stripped = text.strip()
        if not stripped:
            continue
        if stripped.startswith(COMMENT):
            comments.append(clean(stripped))
            continue
        if "\0" in text:
            raise CampaignError(f"{file}, line {number}: is not text; save the file as CSV in UTF-8")
        yield number, text.rstrip("\r\n")


class _Blocks:
    """Columns of a table, converted block by block."""

    def __init__(self, file: str, dialect: Dialect) -> None:
        self.file, self.dialect = file, dialect
        self._parts: list[list[NDArray[Any]]] = [[] for _ in dialect.numeric]
        self._words: list[dict[str, int]] = [{} for _ in dialect.numeric]

    def add(self, lines: Sequence[Line]) -> None:
        """Convert the next block of lines."""
        width = len(self.dialect.numeric)
        rows = []
        for number, text in lines:
            try:
                fields = self.dialect.fields(text)
            except ValueError:
                raise CampaignError(
                    f'{self.file}, line {number}: a quotation mark (") is not closed; close or remove it'
                ) from None
            if len(fields) != width:
                raise self._wrong_width(number, fields, width)
            rows.append(fields)
        for column, texts in enumerate(zip(*rows, strict=True)):
            if self.dialect.numeric[column]:
                self._parts[column].append(self._numbers(column, texts, lines))
            else:
                known = self._words[column]
                codes = [known.setdefault(clean(text.strip()), len(known)) for text in texts]
                self._parts[column].append(np.array(codes, dtype=np.float64))

    def columns(self) -> Iterator[tuple[NDArray[Any], tuple[str, ...]]]:
        """Values and words of each column."""
        for parts, words in zip(self._parts, self._words, strict=True):
            values = np.concatenate(parts)
            parts.clear()
            yield values, tuple(words)

    def _numbers(self, column: int, texts: Sequence[str], lines: Sequence[Line]) -> NDArray[Any]:
        plain: Sequence[str] = texts
        if self.dialect.decimal_comma:
            plain = [text.replace(",", ".") for text in texts]
        try:
            values = np.array(list(map(float, plain)), dtype=np.float64)
        except ValueError:
            values = None
        # Python accepts 1_000, which no program writes; a point beside decimal commas may be a group of thousands.
        strange = "_." if self.dialect.decimal_comma else "_"
        if values is not None and not any(sign in text for text in texts for sign in strange):
            return values
        numbers = [read_number(text, decimal_comma=self.dialect.decimal_comma) for text in texts]
        for (line, _), text, number in zip(lines, texts, numbers, strict=True):
            if number is None:
                raise CampaignError(
                    f'{self.file}, line {line}, column {column + 1}: "{clean(text.strip())[:40]}" {self._mistake(text)}'
                )
        return np.array(numbers)

    def _mistake(self, text: str) -> str:
        """Message about a field that is not a number, with the remedy."""
        sign, other = (",", ".") if self.dialect.decimal_comma else (".", ",")
        if other in text and is_written_number(text):
            word = {",": "comma", ".": "point"}
            return (
                f"has a {word[other]} where decimals are {word[sign]}s, and no groups of three digits: write one "
                "decimal sign in all rows"
            )
        return "is not a number; correct it, or leave the field empty"

    def _wrong_width(self, line: int, fields: Sequence[str], width: int) -> CampaignError:
        if self.dialect.separator == "," and len(fields) > width:
            remedy = "are its decimals commas? separate the fields by semicolons, or write decimal points"
        else:
            remedy = "is the row cut short?" if len(fields) < width else "remove the surplus fields"
        return CampaignError(f"{self.file}, line {line}: has {len(fields)} fields, other rows have {width}: {remedy}")


def _doubt_decimals(sample: Sequence[Line], first: int, dialect: Dialect) -> str:
    """Reason why decimals may be groups of thousands; empty if they cannot."""
    rows = [dialect.fields(text) for number, text in sample if number > first]
    rows = [fields for fields in rows if len(fields) == len(dialect.numeric)]
    if not may_part_thousands(rows, decimal_comma=dialect.decimal_comma):
        return ""
    sign = "comma" if dialect.decimal_comma else "point"
    return (
        f"has three digits behind each {sign}, beside columns of whole numbers: decimals were read; if these are groups"
        " of thousands, all such numbers are 1000 times as large: export the file again without groups"
    )


def _find_preamble_without_header(sample: Sequence[Line], dialect: Dialect) -> list[str]:
    """Lines before the first row of numbers in a table without names."""
    preamble = []
    for _, text in sample:
        fields = dialect.fields(text)
        if len(fields) == len(dialect.numeric):
            break
        preamble.append(text)
    return preamble


def _find_commented_header(comments: Sequence[str], dialect: Dialect) -> list[Row]:
    """Names in the last comment with as many words as the table has columns; empty if there is none."""
    for comment in reversed(comments):
        text = re.sub(r"^[#%/!\s]+", "", comment)
        for separator in dict.fromkeys((dialect.separator or ",", ",", "\t", ";", "")):
            try:
                fields = [field.strip() for field in split_fields(text, separator)]
            except ValueError:
                continue
            if len(fields) == len(dialect.numeric) and all(field[:1].isalpha() for field in fields):
                return [(0, fields)]
    return []


def _split_names_and_units(header: Sequence[Row], width: int) -> tuple[list[str], list[str], list[str], list[str]]:
    """Unique names of columns, their units from names or a row of units, name with unit cell, and unit cells."""
    rows = [fields for _, fields in header]
    of_units = [row for row in rows if _is_unit_row(row)]
    units_alone = len(of_units) == len(rows) > 0  # the units are the names of the columns
    if units_alone:
        of_units = of_units[1:]
    of_names = _without_merged_cells([row for row in rows if not any(row is other for other in of_units)])
    names, units, labels, cells = [], [], [], []
    for column in range(width):
        cell = next((row[column] for row in of_units), "")
        words = [row[column] for row in of_names if row[column]]
        name = " ".join(dict.fromkeys(words))
        part, unit = split_unit_cell(cell, name=name)
        name = " ".join(word for word in (name, part) if word) or f"column {column + 1}"
        names.append(name)
        alone = split_unit_cell(name)[1] if units_alone and len(name) > 1 else ""
        # A symbol such as V or V2 may be a name.
        units.append(unit or split_label(name)[1] or (alone if alone in OF_UNIT or "/" in alone else ""))
        labels.append(" ".join([name, *(row[column] for row in of_units)]))
        cells.append(cell)
    return make_unique_names(names), units, labels, cells


def _without_merged_cells(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Rows of names, with a cell that spans several columns, as above "Amp, Phase, Amp, Phase", repeated in each."""
    filled = [[*row] for row in rows]
    for above, below in itertools.pairwise(filled):
        named = [place for place, cell in enumerate(above) if cell]
        ends = [*named[1:], len(above)]
        starts = [place for place, end in zip(named, ends, strict=True) if end > place + 1]
        size = min((end - place for place, end in zip(named, ends, strict=True) if place in starts), default=0)
        blocks = [below[place : place + size] for place in starts]
        if len(blocks) > 1 and all(blocks[0]) and all(block == blocks[0] for block in blocks):
            for place in starts:
                above[place : place + size] = [above[place]] * size
    return filled


def _is_unit_row(row: Sequence[str]) -> bool:
    """Whether at least half of the fields that are not empty are units."""
    written = [field for field in row if field]
    return bool(written) and 2 * sum(bool(split_unit_cell(field)[1]) for field in written) >= len(written)


def _find_facts(texts: Sequence[str]) -> dict[str, str]:
    """Facts in comments and preamble of the form "key: value"."""
    facts: dict[str, str] = {}
    for text in texts:
        match = KEY_VALUE.match(text)
        if match and len(facts) < 50:
            facts.setdefault(match[1].strip().lower(), match[2].strip())
    return facts
