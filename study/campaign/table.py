"""Tables within measured files: columns of one length that belong together."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from correlation.file.column import Column, MeasuredFile

#: Shorter columns are parameters, not series.
FEWEST = 3
INDEX = re.compile(r"(\([\d:,]+\)|\[[\d,]+\])$")


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """Columns that were measured together.

    Parameters
    ----------
    file
        Measured file.
    path
        Common part of the names of its columns, such as "run(2)"; empty for a whole file.
    columns
        Columns of one length.
    scalars
        Single numbers that stand beside them, by their short names.
    """

    file: MeasuredFile
    path: str
    columns: tuple[Column, ...]
    scalars: Mapping[str, float] = field(default_factory=dict)

    def short_name(self, column: Column) -> str:
        """Name of a column without the path of the table."""
        return column.name.removeprefix(self.path).lstrip("./") or column.name

    @property
    def label(self) -> str:
        """Name of the table for people and for names of tests."""
        return f"{file_stem(self.file.path.name)} {self.path}".strip()


def file_stem(name: str) -> str:
    """Name of a file without its suffix, also of a compressed one."""
    return Path(name.removesuffix(".gz")).stem


def split_tables(file: MeasuredFile) -> list[Table]:
    """Tables of a file: by abscissa where the file says it, else by path and length.

    Parameters
    ----------
    file
        Measured file.

    Returns
    -------
    Tables in the order of the file, without parameters and single words.
    """
    groups: dict[tuple[str, str, int], list[Column]] = {}
    for column in file.columns:
        if len(column.values) >= FEWEST:
            abscissa = column.abscissa or (column.name if _is_abscissa(file, column) else "")
            path = "" if abscissa else _path(column.name, file.format)
            groups.setdefault((abscissa, path, len(column.values)), []).append(column)
    tables = []
    for (abscissa, path, length), columns in groups.items():
        # What stands at the top of a file holds for all tables of its length.
        common = [] if abscissa or not path else groups.get(("", "", length), [])
        tables.append(Table(file=file, path=path, columns=(*common, *columns), scalars=_scalars(file, path)))
    paths = {table.path for table in tables if table.path}
    return [table for table in tables if table.path or not paths or _stands_alone(table, tables)]


def _stands_alone(table: Table, tables: list[Table]) -> bool:
    """Whether a table at the top of a file is more than the common columns of others."""
    return not any(set(table.columns) < set(other.columns) for other in tables)


def _is_abscissa(file: MeasuredFile, column: Column) -> bool:
    return any(other.abscissa == column.name for other in file.columns)


def _path(name: str, format_name: str) -> str:
    separator = "/" if format_name == "hdf5" else "."
    if format_name not in {"hdf5", "matlab 5", "matlab 7.3"}:
        return ""
    return INDEX.sub("", name).rpartition(separator)[0]


def _scalars(file: MeasuredFile, path: str) -> dict[str, float]:
    numbers: dict[str, float] = {}
    for column in file.columns:
        if len(column.values) == 1 and not column.words and _path(column.name, file.format) in {path, ""}:
            numbers[column.name.removeprefix(path).lstrip("./")] = float(column.values[0].real)
    return numbers
