"""Limits of all quantities as a CSV table."""

import csv
import io
from collections.abc import Sequence

from hbsolve.limits.result import SIDES
from study.limits.result import LimitCurves, list_columns, list_rows


def format_several_csv(curves: Sequence[LimitCurves]) -> str:
    """Format one line per quantity, level and frequency, see `format_limits_csv`; the unit has a separate column."""
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
