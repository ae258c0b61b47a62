"""Tables in measured files: columns of equal length that belong together."""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from correlation.file.column import Column, MeasuredFile
from correlation.file.format.lvm import SEGMENTS
from study.campaign.column_role import Role, recognise_column
from study.campaign.run_name import LEVEL_IN_NAME, make_naming_scheme, read_level

#: Smallest length of a series; shorter columns are parameters.
FEWEST = 3
#: Names of the only array in a structure, whose own name is that of the quantity.
OF_ONE = {"value", "values", "data", "val"}
INDEX = re.compile(r"(\([\d:,]+\)|\[[\d,]+\])$")


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredTable:
    """Columns that were measured together.

    Parameters
    ----------
    file
        Measured file.
    path
        Common part of the names of its columns, such as "run(2)"; empty for a whole file.
    columns
        Columns of equal length.
    scalars
        Single numbers in the same group, by their short names.
    group
        Group of all channels of the file, if there is only one; else empty.
    of_set
        Words that distinguish these channels from other sets of channels of the table, such as "3N"; empty for one set.
    names
        Names of channels without these words, by the names of their columns.
    harmonic
        Harmonic of all responses [-].
    """

    file: MeasuredFile
    path: str
    columns: tuple[Column, ...]
    scalars: Mapping[str, float] = field(default_factory=dict)
    group: str = ""
    of_set: str = ""
    names: Mapping[str, str] = field(default_factory=dict)
    harmonic: int = 1

    def short_name(self, column: Column) -> str:
        """Name of a column without the path of the table and without the words of its set of channels."""
        if column.name in self.names:
            return self.names[column.name]
        short = column.name.removeprefix(self.path or self.group).lstrip("./") or column.name
        return _without_last(short)

    @property
    def label(self) -> str:
        """Name of the table, for messages and names of tests."""
        return " ".join(word for word in (make_file_stem(self.file.path.name), self.path, self.of_set) if word)

    @property
    def place(self) -> str:
        """File, group in the file and set of channels, for messages."""
        return ", ".join(word for word in (self.file.path.name, self.path, self.of_set) if word)


def make_file_stem(name: str) -> str:
    """Name of a file without its suffix and ".gz", in Unicode form NFC."""
    return unicodedata.normalize("NFC", Path(name.removesuffix(".gz")).stem)


def split_tables(file: MeasuredFile) -> list[MeasuredTable]:
    """Split a file into tables, by abscissa if the file states it, else by path and length.

    Parameters
    ----------
    file
        Measured file.

    Returns
    -------
    Tables in the order of the file; columns shorter than `FEWEST` are left out.
    """
    groups: dict[tuple[str, str, int], list[Column]] = {}
    channels = _find_channels_of_groups(file)
    runs, single = _find_groups_of_runs(channels), next(iter(channels)) if len(channels) == 1 else ""
    joined = _find_structures_of_one(file)
    for column in file.columns:
        if len(column.values) >= FEWEST:
            abscissa = column.abscissa or (column.name if _is_abscissa(file, column) else "")
            path = "" if abscissa else _find_path(column.name, file.format)
            path = joined.get(column.name, path)
            path = group if (group := _group(column.name)) in runs else path
            groups.setdefault((abscissa, path, len(column.values)), []).append(column)
    tables = []
    for (abscissa, path, length), columns in groups.items():
        # Columns at the top level of a file belong to all tables of their length.
        common = groups.get((abscissa, "", length), []) if path else []
        scalars = _find_attributes(columns) | _find_scalars(file, path)
        tables.append(MeasuredTable(file=file, path=path, columns=(*common, *columns), scalars=scalars, group=single))
    paths = {table.path for table in tables if table.path}
    return [table for table in tables if table.path or not paths or _stands_alone(table, tables)]


def _find_structures_of_one(file: MeasuredFile) -> dict[str, str]:
    """Common path of structures with one column each, "freq.value" and "acc.value", if one is a time or a frequency."""
    alone: dict[tuple[str, int], list[Column]] = {}
    for column in file.columns:
        parts = column.name.split("/" if file.format == "hdf5" else ".")
        if len(parts) > 1 and parts[-1].lower() in OF_ONE and _find_path(column.name, file.format):
            above = ("/" if file.format == "hdf5" else ".").join(parts[:-2])
            alone.setdefault((above, len(column.values)), []).append(column)
    return {
        column.name: above
        for (above, _), columns in alone.items()
        if {recognise_column(one, _without_last(one.name)).role for one in columns} & {Role.FREQUENCY, Role.TIME}
        for column in columns
    }


def _without_last(name: str) -> str:
    """Name of a structure with one column: "freq" for "freq.value"."""
    whole, mark, last = re.match(r"(.*?)([./]?)([^./]*)$", name).groups()  # type: ignore[union-attr]
    return whole if mark and last.lower() in OF_ONE else name


def _stands_alone(table: MeasuredTable, tables: list[MeasuredTable]) -> bool:
    """Whether a table at the top level of a file has more than the common columns of others."""
    return not any(set(table.columns) < set(other.columns) for other in tables)


def _is_abscissa(file: MeasuredFile, column: Column) -> bool:
    return any(other.abscissa == column.name for other in file.columns)


def _find_path(name: str, format_name: str) -> str:
    separator = "/" if format_name == "hdf5" else "."
    if format_name not in {"hdf5", "matlab 5", "matlab 7.3"}:
        return ""
    return INDEX.sub("", name).rpartition(separator)[0]


def _find_channels_of_groups(file: MeasuredFile) -> dict[str, dict[str, Column]]:
    """Channels of the groups of a TDMS file or the segments of a LabVIEW file, by group and name; empty for others."""
    groups: dict[str, dict[str, Column]] = {}
    for column in file.columns if file.format == "tdms" or SEGMENTS in file.facts else ():
        if group := _group(column.name):
            groups.setdefault(group, {})[column.name.removeprefix(f"{group}/")] = column
    return groups


def _group(name: str) -> str:
    return name.partition("/")[0] if "/" in name else ""


def _find_groups_of_runs(groups: Mapping[str, Mapping[str, Column]]) -> set[str]:
    """Groups that are runs of one set of sensors: they have equal channels with a force, or names of one naming scheme.

    Groups "tip" and "root" with equal channels and no force in them are places, not runs.
    """
    alike: dict[frozenset[str], list[str]] = {}
    for group, channels in groups.items():
        alike.setdefault(frozenset(channels), []).append(group)
    names, members = max(alike.items(), key=lambda item: len(item[1]), default=(frozenset[str](), []))
    if len(members) < 2:
        return set()
    first = groups[members[0]]
    driven = any(recognise_column(column, name).role is Role.FORCE for name, column in first.items())
    if not driven and len({make_naming_scheme(group) for group in members}) > 1:
        return set()
    # A group that lacks some channels is a run as well.
    return {group for group, channels in groups.items() if set(channels) <= names}


def _find_attributes(columns: Sequence[Column]) -> dict[str, float]:
    """Numbers in the common facts of all columns, such as attributes of their group."""
    shared = set.intersection(*(set(column.facts.items()) for column in columns))
    numbers = {key: number for key, text in shared if (number := _number(text)) is not None}
    for key, text in shared:
        if match := LEVEL_IN_NAME.fullmatch(text.strip()):  # level = "3 N" is level_N = 3
            value, unit = read_level(match)
            numbers[f"{key}_{unit}"] = value
    return numbers


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _find_scalars(file: MeasuredFile, path: str) -> dict[str, float]:
    numbers: dict[str, float] = {}
    for column in file.columns:
        if len(column.values) == 1 and not column.words and _find_path(column.name, file.format) in {path, ""}:
            numbers[column.name.removeprefix(path).lstrip("./")] = float(column.values[0].real)
    return numbers
