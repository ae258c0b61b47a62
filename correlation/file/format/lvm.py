"""LabVIEW measurement files (.lvm): a header of the file, then segments, each with a header of its channels."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, unique_names
from correlation.file.format import MEASURED_FILES, MeasuredFileFormat
from correlation.file.number import read_number
from correlation.file.text_table.open_text import clean, open_text
from correlation.file.text_table.read_table import read_table
from correlation.file.unit_label import split_label, unit_text

FIRST_LINE, END, X = "LabVIEW Measurement", "***End_of_Header***", "X_Value"
SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}
#: Units of an abscissa without a label of its unit, by its dimension.
SI_OF_X = {"time": "s", "frequency": "Hz"}
Line = tuple[int, list[str]]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Segment:
    """Names of its columns, what its header says of each channel, and its numbers, shape (n, k)."""

    names: tuple[str, ...]
    header: Mapping[str, Sequence[str]]
    table: Float[NDArray[np.float64], "n k"]


def recognise(head: bytes) -> bool:
    """Whether a file begins with the header of LabVIEW."""
    return head.removeprefix(b"\xef\xbb\xbf").startswith(FIRST_LINE.encode())


def read(path: Path) -> MeasuredFile:
    """Channels with the abscissa that they share; the rows of all segments stand one below the other.

    Raises
    ------
    CampaignError
        A header that does not end, a row that is cut, or segments that do not continue the first.
    """
    with open_text(path) as stream:
        texts = [clean(text.rstrip("\r\n")) for text in stream]
    if not texts or not texts[0].startswith(FIRST_LINE):  # a plain table of this suffix
        return read_table(path, format_name="lvm")
    facts = {text.split(None, 1)[0]: text.split(None, 1)[1].strip() for text in _header(texts) if len(text.split()) > 1}
    separator = SEPARATORS.get(facts.get("Separator", "tab").lower(), "\t")
    lines = [(number, text.split(separator)) for number, text in enumerate(texts, start=1)]
    segments = list(_segments(path.name, lines, comma=facts.get("Decimal_Separator") == ","))
    if not segments:
        raise CampaignError(f'{path.name}: has no rows below a second "{END}"; export it again')
    table = np.concatenate([segment.table for segment in segments if segment.names == segments[0].names])
    begins_anew = segments[0].names[0] == X and not (np.diff(table[:, 0]) > 0).all()
    if len(segments) > 1 and (begins_anew or len(table) < sum(len(segment.table) for segment in segments)):
        raise CampaignError(f"{path.name}: has {len(segments)} segments; export each to a file of its own")
    return MeasuredFile(path=path, format="lvm", columns=_columns(segments[0], table), facts=facts)


def _header(texts: Sequence[str]) -> Sequence[str]:
    """Lines of the header of the file."""
    return texts[1 : next((row for row, text in enumerate(texts) if text.startswith(END)), len(texts))]


def _segments(file: str, lines: Sequence[Line], *, comma: bool) -> Iterator[_Segment]:
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
        table = np.array([_row(file, line, len(names), comma=comma) for line in written[1:stop]])
        yield _Segment(names=names, header=header, table=_with_x(names, header, table, comma=comma))


def _row(file: str, line: Line, width: int, *, comma: bool) -> list[float]:
    number, fields = line
    if len(fields) < width:
        raise CampaignError(f"{file}, line {number}: has {len(fields)} fields, other rows have {width}: is it cut?")
    values = [read_number(field, decimal_comma=comma) for field in fields[:width]]
    wrong = next((field for field, value in zip(fields, values, strict=False) if not isinstance(value, float)), None)
    if wrong is not None:
        raise CampaignError(f'{file}, line {number}: "{wrong[:40]}" is no number; correct it')
    return [value for value in values if isinstance(value, float)]


def _with_x(
    names: Sequence[str], header: Mapping[str, Sequence[str]], table: Float[NDArray[np.float64], "n k"], *, comma: bool
) -> Float[NDArray[np.float64], "n k"]:
    """Numbers with the abscissas that the header states by start and step where their columns are empty."""
    start, step = (read_number(header.get(key, ["nan"])[0], decimal_comma=comma) for key in ("X0", "Delta_X"))
    for column, name in enumerate(names):
        if name == X and np.isnan(table[:, column]).all() and isinstance(start, float) and isinstance(step, float):
            table[:, column] = start + step * np.arange(len(table))
    return table


def _columns(segment: _Segment, table: Float[NDArray[np.float64], "n k"]) -> tuple[Column, ...]:
    """Columns with their units; each channel has the abscissa before it."""

    def said(key: str, channel: int) -> str:
        texts = segment.header.get(key, [])
        return texts[channel].strip() if channel < len(texts) else ""

    dimension = said("X_Dimension", 0).lower() or "time"
    called = [dimension if name == X else name or "channel" for name in segment.names]
    columns: list[Column] = []
    abscissa, channel = None, 0
    for name, original, values in zip(unique_names(called), segment.names, table.T, strict=True):
        if original == X:
            abscissa = name
            unit = unit_text(said("X_Unit_Label", 0)) or SI_OF_X.get(dimension, "")
            columns.append(Column(name=name, values=values, unit=unit, function=dimension))
        else:
            label = said("Y_Unit_Label", channel)
            unit = unit_text(label, name=name) or split_label(name)[1]
            columns.append(Column(name=name, values=values, unit=unit, unit_label=label, abscissa=abscissa))
            channel += 1
    return tuple(columns)


MEASURED_FILES.register(
    MeasuredFileFormat(
        name="lvm", holds="a LabVIEW measurement file (.lvm)", suffixes=(".lvm",), recognise=recognise, read=read
    )
)
