"""Tables of a measured file, one for each set of channels that was measured together."""

from correlation.file.column import MeasuredFile
from study.campaign.array_set import sets_by_array
from study.campaign.channel_set import sets_by_abscissa, sets_by_harmonic, sets_by_header, sets_by_name, split_sets
from study.campaign.dataset_set import sets_by_dataset, sets_by_dataset_harmonic
from study.campaign.table import Table, split_tables

#: Ways to tell sets of channels, the surest first; harmonics stand within each of these.
FINDERS = (sets_by_dataset, sets_by_array, sets_by_name, sets_by_header, sets_by_abscissa)


def find_tables(file: MeasuredFile) -> tuple[list[Table], list[str]]:
    """Tables of a file, and which of its columns belong to no set that is known, one sentence each.

    Parameters
    ----------
    file
        Measured file.
    """
    tables: list[Table] = []
    left_out: list[str] = []
    for whole in split_tables(file):
        sets, lost = split_sets(whole, FINDERS)
        left_out += lost
        for table in sets:
            harmonics, lost = split_sets(table, [sets_by_dataset_harmonic, sets_by_harmonic])
            tables += harmonics
            left_out += lost
    return tables, left_out
