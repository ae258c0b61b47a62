"""A table of a page."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Table:
    """Rows of words and numbers.

    Parameters
    ----------
    head
        Names of the columns, with units.
    rows
        One text per column; numbers are right-aligned.
    words
        Number of leading columns that are words.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: int = 1
