"""Columns of dates with times of the day, such as 2025-11-14 20:07:10.531, as seconds from the first row."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from correlation.file.column import Column

#: The clock of a record changes in at least this share of its rows; dates of a few runs stay words [-].
CHANGES = 0.5


def read_date_times(column: Column) -> Column:
    """A column of words that are dates with times in ISO 8601 as a time; any other column as it is.

    Parameters
    ----------
    column
        Column of a table.
    """
    if len(column.words) < max(2, CHANGES * len(column.values)) or not all(":" in word for word in column.words):
        return column
    try:
        stamps = [datetime.fromisoformat(word) for word in column.words]
    except ValueError:
        return column
    # A stamp without a zone is compared as if all were of one.
    instants = [stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC) for stamp in stamps]
    seconds = np.array([(instant - instants[0]).total_seconds() for instant in instants])
    return replace(
        column, values=seconds[column.values.astype(np.int64)], words=(), unit="s", unit_label="", function="time",
        facts={**column.facts, "begins": column.words[0]},
    )  # fmt: skip
