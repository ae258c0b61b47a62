"""LabVIEW measurement files (.lvm): a file header, then segments, each with a header of its channels."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, make_unique_names
from correlation.file.format import MEASURED_FILES, MeasuredFileFormat
from correlation.file.number import read_number
from correlation.file.text_table.open_text import clean, open_text
from correlation.file.text_table.read_table import read_table
from correlation.file.unit_label import read_unit, split_label

FIRST_LINE, END, X = "LabVIEW Measurement", "***End_of_Header***", "X_Value"
SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}
#: Fact of a file of several segments: their number.
SEGMENTS = "segments"
#: Unit of an abscissa without a unit label, by its dimension.
SI_OF_X = {"time": "s", "frequency": "Hz"}
Line = tuple[int, list[str]]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Segment:
    """Segment of a file: names of its columns, header entries of each channel, and numbers, shape (n, k)."""

    names: tuple[str, ...]
    header: Mapping[str, Sequence[str]]
    table: Float[NDArray[np.float64], "n k"]


def recognise(head: bytes) -> bool:
    """Whether a file begins with the header of LabVIEW."""
    return head.removeprefix(b"\xef\xbb\xbf").startswith(FIRST_LINE.encode())


def read(path: Path) -> MeasuredFile:
    """Read the channels with their abscissas; consecutive segments are joined, others are "segment 1", "segment 2".

    Raises
    ------
    CampaignError
        A header does not end, or a row is cut.
    """
    with open_text(path) as stream:
        texts = [clean(text.rstrip("\r\n")) for text in stream]
    if not texts or not texts[0].startswith(FIRST_LINE):  # a plain table with this suffix
        return read_table(path, format_name="lvm")
    facts = {
        text.split(None, 1)[0]: text.split(None, 1)[1].strip() for text in _find_header(texts) if len(text.split()) > 1
    }
    separator = SEPARATORS.get(facts.get("Separator", "tab").lower(), "\t")
    lines = [(number, text.split(separator)) for number, text in enumerate(texts, start=1)]
    segments = list(_split_segments(path.name, lines, comma=facts.get("Decimal_Separator") == ","))
    if not segments:
        raise CampaignError(f'{path.name}: has no rows below a second "{END}"; export it again')
    if all(segment.names == segments[0].names for segment in segments):
        table = np.concatenate([segment.table for segment in segments])
        if segments[0].names[0] != X or (np.diff(table[:, 0]) > 0).all():
            segments = [replace(segments[0], table=table)]
    if len(segments) > 1:
        facts[SEGMENTS] = str(len(segments))
    return MeasuredFile(path=path, format="lvm", columns=tuple(_list_columns(segments)), facts=facts)


def _find_header(texts: Sequence[str]) -> Sequence[str]:
    """Lines of the header of the file."""
    return texts[1 : next((row for row, text in enumerate(texts) if text.startswith(END)), len(texts))]


def _split_segments(file: str, lines: Sequence[Line], *, comma: bool) -> Iterator[_Segment]:
    ends = [row for row, (_, fields) in enumerate(lines) if fields[0] == END]
    for before, end, after in zip(ends, ends[1:], [*ends[2:], len(lines)], strict=False):
        header = {fields[0]: fields[1:] for _, fields in lines[before + 1 : end] if fields[0].isidentifier()}
        written = [line for line in lines[end + 1 : after] if any(field.strip() for field in line[1])]
        # The header of the next segment begins with the number of its channels.
        stop = next((row for row, (_, fields) in enumerate(written) if fields[0] == "Channels"), len(written))
        if stop < 2:
            raise CampaignError(f"{file}, line {lines[end][0]}: has no rows below this header; export it again")
        names = tuple(field.strip() for field in written[0][1])
        names = names[: names.index("Comment")] if "Comment" in names else names
        table = np.array([_read_row(file, line, len(names), comma=comma) for line in written[1:stop]])
        yield _Segment(names=names, header=header, table=_with_x(names, header, table, comma=comma))


def _read_row(file: str, line: Line, width: int, *, comma: bool) -> list[float]:
    number, fields = line
    if len(fields) < width:
        raise CampaignError(f"{file}, line {number}: has {len(fields)} fields, other rows have {width}: is it cut?")
    values = [read_number(field, decimal_comma=comma) for field in fields[:width]]
    wrong = next((field for field, value in zip(fields, values, strict=False) if not isinstance(value, float)), None)
    if wrong is not None:
        raise CampaignError(f'{file}, line {number}: "{wrong[:40]}" is not a number; correct it')
    return [value for value in values if isinstance(value, float)]


def _read_entry(names: Sequence[str], header: Mapping[str, Sequence[str]], key: str, column: int) -> str:
    """Header entry of the channel in a column: above it or, by other programs, in the order of the channels."""
    texts = [text.strip() for text in header.get(key, [])]
    above = names[0] == X and not any(text for name, text in zip(names[1:], texts, strict=False) if name == X)
    place = column - 1 if above else column - names[:column].count(X)
    return texts[place] if 0 <= place < len(texts) else ""


def _with_x(
    names: Sequence[str], header: Mapping[str, Sequence[str]], table: Float[NDArray[np.float64], "n k"], *, comma: bool
) -> Float[NDArray[np.float64], "n k"]:
    """Fill empty columns of abscissas from the start and step in the header."""
    for column, name in enumerate(names):
        start, step = (
            read_number(_read_entry(names, header, key, column + 1), decimal_comma=comma) for key in ("X0", "Delta_X")
        )
        if name == X and np.isnan(table[:, column]).all() and isinstance(start, float) and isinstance(step, float):
            table[:, column] = start + step * np.arange(len(table))
    return table


def _list_columns(segments: Sequence[_Segment]) -> Iterator[Column]:
    """Yield columns with their units; the abscissa of a channel is the last one before it in its segment."""
    for number, segment in enumerate(segments, start=1):
        group = f"segment {number}/" if len(segments) > 1 else ""

        def read_entry(key: str, place: int, segment: _Segment = segment) -> str:
            return _read_entry(segment.names, segment.header, key, place)

        dimensions = [read_entry("X_Dimension", place + 1).lower() or "time" for place in range(len(segment.names))]
        pairs = zip(dimensions, segment.names, strict=True)
        called = [dimension if name == X else name or "channel" for dimension, name in pairs]
        abscissa: str | None = None
        for place, (name, values) in enumerate(zip(make_unique_names(called), segment.table.T, strict=True)):
            if segment.names[place] == X:
                abscissa, dimension = f"{group}{name}", dimensions[place]
                unit = read_unit(read_entry("X_Unit_Label", place + 1)) or SI_OF_X.get(dimension, "")
                yield Column(name=abscissa, values=values, unit=unit, function=dimension)
            else:
                label = read_entry("Y_Unit_Label", place)
                unit = read_unit(label, name=name) or split_label(name)[1]
                yield Column(name=f"{group}{name}", values=values, unit=unit, unit_label=label, abscissa=abscissa)


MEASURED_FILES.register(
    MeasuredFileFormat(
        name="lvm", holds="a LabVIEW measurement file (.lvm)", suffixes=(".lvm",), recognise=recognise, read=read
    )
)
