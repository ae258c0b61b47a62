"""CSV and other tables of text: any separator, decimal points or commas, one or more lines of header."""

from functools import partial

from correlation.file.format import MEASURED_FILES, MeasuredFileFormat
from correlation.file.text_table.open_text import BYTE_ORDER_MARKS, GZIP
from correlation.file.text_table.read_table import read_table


def recognise(head: bytes) -> bool:
    """Whether a file begins with the mark of gzip or of Unicode; other text is recognised by its suffix."""
    return head.startswith((GZIP, *BYTE_ORDER_MARKS))


MEASURED_FILES.register(
    MeasuredFileFormat(
        name="csv",
        holds="a table of text (.csv, .txt, .dat, .tsv, also .gz)",
        suffixes=(".csv", ".txt", ".dat", ".asc", ".tsv", ".csv.gz", ".txt.gz", ".tsv.gz", ".dat.gz"),
        recognise=recognise,
        read=partial(read_table, format_name="csv"),
    )
)
