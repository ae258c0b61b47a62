"""Measured files of a campaign folder, each read once, and the selection of rows by an entry of the manifest."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from correlation.campaign.campaign_path import find_file
from correlation.campaign.toml_table import TomlTable
from correlation.file.column import Column, MeasuredFile
from correlation.file.read_file import read_file

MISSING = ("refuse", "skip")


@dataclass(frozen=True, kw_only=True)
class MeasuredFiles:
    """Measured files of a folder, each read once.

    Parameters
    ----------
    folder
        Folder of the campaign.
    known
        Files that were read, by name.
    """

    folder: Path
    known: dict[str, MeasuredFile] = field(default_factory=dict)

    def read(self, name: str) -> MeasuredFile:
        """Read a file of the folder, or return it if it was read before.

        Raises
        ------
        CampaignError
            The file does not exist, lies outside the folder, or cannot be read.
        """
        if name not in self.known:
            self.known[name] = read_file(find_file(self.folder, name))
        return self.known[name]


def take_rows(
    table: TomlTable, file: MeasuredFile, names: Sequence[str], *, needed: Sequence[str] | None = None
) -> MeasuredFile:
    """Select the rows of a file by ``rows`` and ``missing`` of an entry.

    Parameters
    ----------
    table
        Entry. ``rows = { COLUMN = VALUE }`` selects the rows with these values; ``missing = "skip"`` leaves out rows
        with values that are not finite.
    file
        The whole file.
    names
        Columns that the entry uses.
    needed
        Columns whose values must be finite under ``missing = "skip"``; None for all in `names`.

    Raises
    ------
    CampaignError
        A column does not exist, or no row remains.
    """
    wanted = table.take("rows", dict, {})
    skip = "missing" in table.values and table.choice("missing", MISSING) == "skip"
    if not wanted and not skip:
        return file
    columns = {name: file.column(name) for name in (*names, *wanted)}
    lengths = {len(column.values) for column in columns.values()}
    if len(lengths) > 1:
        raise table.problem("rows", f"the columns of {file.path.name} have different lengths {sorted(lengths)}")
    mask = np.ones(lengths.pop(), dtype=bool)
    for name, value in wanted.items():
        mask &= _has(table, file, columns[name], value)
        if not mask.any():
            raise table.problem("rows", f'no row of {file.path.name} that is left has "{name}" = {value!r}')
    if skip:
        mask &= np.all([np.isfinite(columns[name].values) for name in (names if needed is None else needed)], axis=0)
        if not mask.any():
            raise table.problem("missing", f"every row of {file.path.name} lacks a value: remove the entry")
    return with_rows(file, columns, mask)


def without_padding(file: MeasuredFile, names: Iterable[str]) -> MeasuredFile:
    """Remove the rows at the end of a file in which none of some columns has a number, as beside longer columns.

    Parameters
    ----------
    file
        The whole file.
    names
        Columns; a number in any of them keeps the row.
    """
    columns = [file.column(name) for name in names]
    lengths = {len(column.values) for column in columns}
    if len(lengths) != 1:
        return file
    there = np.any([np.isfinite(column.values) for column in columns], axis=0)
    length, end = len(there), int(np.flatnonzero(there)[-1]) + 1 if there.any() else len(there)
    if end == length:
        return file
    cut = (replace(one, values=one.values[:end]) if len(one.values) == length else one for one in file.columns)
    return replace(file, columns=tuple(cut))


def _has(table: TomlTable, file: MeasuredFile, column: Column, value: object) -> NDArray[np.bool_]:
    """Mask of the rows of a column that have a value: a number, or a word in a column of text."""
    if column.words:
        if value not in column.words:
            listed = ", ".join(column.words[:8])
            raise table.problem("rows", f'"{column.name}" of {file.path.name} is never {value!r}; it has {listed}')
        return np.asarray(column.values == column.words.index(str(value)))
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise table.problem("rows", f'"{column.name}" = {value!r} is not a number: give a value that its rows have')
    there = np.isclose(column.values, value, rtol=1e-9, atol=0.0)
    if not there.any():
        listed = ", ".join(f"{item:g}" for item in np.unique(column.values[np.isfinite(column.values)])[:8].real)
        raise table.problem("rows", f'no row of {file.path.name} has "{column.name}" = {value:g}; it has {listed}')
    return np.asarray(there)


def with_rows(file: MeasuredFile, columns: Mapping[str, Column], mask: NDArray[np.bool_]) -> MeasuredFile:
    """Copy of a file with the given columns only, and the rows of a mask."""
    kept_rows = tuple(replace(column, values=column.values[mask]) for column in columns.values())
    return replace(file, columns=kept_rows)
