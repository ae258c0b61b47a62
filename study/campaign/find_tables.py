"""Tables of a measured file, one per set of channels that were measured together."""

from dataclasses import replace

import numpy as np

from correlation.file.column import MeasuredFile
from study.campaign.array_set import find_sets_by_array
from study.campaign.channel_set import (
    find_role,
    find_sets_by_abscissa,
    find_sets_by_harmonic,
    find_sets_by_header,
    find_sets_by_name,
    find_sets_by_quantity,
    split_sets,
)
from study.campaign.column_role import Role
from study.campaign.dataset_set import find_sets_by_dataset, find_sets_by_dataset_harmonic
from study.campaign.table import MeasuredTable, split_tables

#: Functions that find sets of channels, the most reliable first; each group splits the sets found by the one before.
FINDERS = (
    (find_sets_by_dataset, find_sets_by_array, find_sets_by_name, find_sets_by_header, find_sets_by_abscissa),
    (find_sets_by_quantity,),
    (find_sets_by_dataset_harmonic, find_sets_by_harmonic),
)


def find_tables(file: MeasuredFile) -> tuple[list[MeasuredTable], list[str]]:
    """Split a file into tables; the second result has one sentence on each column of an unknown set.

    Parameters
    ----------
    file
        Measured file.
    """
    tables = split_tables(file)
    left_out: list[str] = []
    for finders in FINDERS:
        parts = [split_sets(table, finders) for table in tables]
        tables = [table for sets, _ in parts for table in sets]
        left_out += [sentence for _, lost in parts for sentence in lost]
    return [_without_padding(table) for table in tables], left_out


def _without_padding(table: MeasuredTable) -> MeasuredTable:
    """Table without rows at its end that have no time, such as those below a run shorter than others in the file."""
    times = [one for one in table.columns if find_role(table, one) is Role.TIME]
    there = np.any([np.isfinite(one.values) for one in times], axis=0) if times else np.ones(1, dtype=np.bool_)
    if not there.any() or there[-1]:
        return table
    end = int(np.flatnonzero(there)[-1]) + 1
    return replace(table, columns=tuple(replace(one, values=one.values[:end]) for one in table.columns))
