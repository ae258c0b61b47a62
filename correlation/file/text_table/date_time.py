"""Conversion of columns of dates with times, such as 2025-11-14 20:07:10.531, to seconds from the first row."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from correlation.file.column import Column

#: Smallest ratio of different dates to rows of a time column [-]; dates of a few runs remain words.
CHANGES = 0.5


def read_date_times(column: Column) -> Column:
    """Convert a column of dates with times in ISO 8601 to a time; any other column is returned unchanged.

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
    # Stamps without a time zone are taken as UTC.
    instants = [stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC) for stamp in stamps]
    seconds = np.array([(instant - instants[0]).total_seconds() for instant in instants])
    return replace(
        column, values=seconds[column.values.astype(np.int64)], words=(), unit="s", unit_label="", function="time",
        facts={**column.facts, "begins": column.words[0]},
    )  # fmt: skip
