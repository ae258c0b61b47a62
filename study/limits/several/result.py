"""Limits of all quantities as one table."""

import csv
import io
from collections.abc import Sequence

from hbsolve.limits.result import SIDES
from study.limits.result import LimitCurves, list_columns, list_rows


def format_several_csv(curves: Sequence[LimitCurves]) -> str:
    """One line a quantity, level and frequency, as `format_limits_csv`; the unit has a column of its own."""
    stream = io.StringIO()
    write = csv.writer(stream, lineterminator="\n").writerow
    for number, item in enumerate(curves):
        columns = [list_columns(item, side, "") for side in range(len(SIDES))]
        if number == 0:
            headings = [name for column in columns for name in column]
            write(["quantity", "unit", "level", "frequency [Hz]", "sampled states", *headings])
        for row in list_rows(item, columns):
            write([item.quantity, item.unit, *row])
    return stream.getvalue()
