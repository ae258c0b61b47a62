"""Tables of a measured file, one for each set of channels that was measured together."""

from correlation.file.column import MeasuredFile
from study.campaign.array_set import sets_by_array
from study.campaign.channel_set import (
    sets_by_abscissa,
    sets_by_harmonic,
    sets_by_header,
    sets_by_name,
    sets_by_quantity,
    split_sets,
)
from study.campaign.dataset_set import sets_by_dataset, sets_by_dataset_harmonic
from study.campaign.table import Table, split_tables

#: Ways to tell sets of channels, the surest first; then what stands within each of these sets.
FINDERS = (
    (sets_by_dataset, sets_by_array, sets_by_name, sets_by_header, sets_by_abscissa),
    (sets_by_quantity,),
    (sets_by_dataset_harmonic, sets_by_harmonic),
)


def find_tables(file: MeasuredFile) -> tuple[list[Table], list[str]]:
    """Tables of a file, and which of its columns belong to no set that is known, one sentence each.

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
    return tables, left_out
