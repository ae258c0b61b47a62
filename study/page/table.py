"""Table of a page."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Table:
    """Table of words and numbers.

    Parameters
    ----------
    head
        Names of the columns, with units.
    rows
        Rows, one text per column; columns of numbers are right-aligned.
    words
        Number of leading columns with words [-].
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: int = 1
